// The results of a campaign after bytes of the file have changed: refused in one line, or they can
// be merged, and the merge says what the file says.
//
// Input: how much of the file's end is missing, in parts of 65,536, as two bytes; then for each
// byte that is another one, three bytes of its place and its value.

#include <stdlib.h>  // NOLINT(modernize-deprecated-headers): mkdtemp is POSIX

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "emulator/ground/start_error.hpp"
#include "tests/fuzz/support.hpp"
#include "tests/tools/campaign/results/synthetic.hpp"
#include "tools/campaign/results/canonical.hpp"
#include "tools/campaign/results/merge.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;
using fuzz::require;

constexpr std::uint64_t kCases = 60;

/// A directory with a good campaign, gone in the end.
class Bench {
 public:
  Bench() {
    std::string name = (fs::temp_directory_path() / "lk-fuzz-XXXXXX").string();
    require(::mkdtemp(name.data()) != nullptr);
    directory_ = name;
    {
      auto store = CampaignStore::create(file(), lk::test::synthetic_head(kCases));
      store.note_shard({0, 2});
      store.put(lk::test::synthetic_cases(0, kCases));
    }
    std::ifstream good(file(), std::ios::binary);
    good_.assign(std::istreambuf_iterator<char>(good), {});
  }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;
  ~Bench() {
    std::error_code ignored;
    fs::remove_all(directory_, ignored);
  }

  const std::string& good() const { return good_; }
  fs::path file() const { return directory_ / "a.db"; }
  fs::path merged() const { return directory_ / "all.db"; }

 private:
  fs::path directory_;
  std::string good_;
};

std::string changed(std::string bytes, std::span<const std::uint8_t> input) {
  fuzz::Input in(input);
  bytes.resize(bytes.size() - bytes.size() * in.word() / 65536);
  while (!in.empty() && !bytes.empty()) {
    const std::size_t low = in.word();
    const std::size_t place = low | static_cast<std::size_t>(in.byte()) << 16U;
    bytes[place % bytes.size()] = static_cast<char>(in.byte());
  }
  return bytes;
}

/// What the file says; nothing: it was refused.
std::optional<std::string> exported(const fs::path& path) {
  std::string text;
  try {
    const auto store = CampaignStore::read(path);
    store.count();
    store.shards();
    export_canonical(store, [&](std::string_view part) { text += part; });
  } catch (const StartError& error) {
    const std::string why = error.what();
    require(!why.empty() && why.find('\n') == std::string::npos);
    return std::nullopt;
  }
  return text;
}

void check(std::span<const std::uint8_t> input) {
  static const Bench bench;
  fs::remove(bench.file());
  const std::string bytes = changed(bench.good(), input);
  std::ofstream(bench.file(), std::ios::binary) << bytes;
  const auto says = exported(bench.file());
  if (!says) return;
  fs::remove(bench.merged());
  merge_campaigns(bench.merged(), std::vector{bench.file()});
  require(exported(bench.merged()) == says);
}

}  // namespace
}  // namespace lk::emulator

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  lk::emulator::check({data, size});
  return 0;
}
