#include "emulator/record/mcap_unpack.hpp"

#include <array>
#include <fstream>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "emulator/files/json_table.hpp"
#include "emulator/files/regular_file.hpp"
#include "emulator/ground/start_error.hpp"
#include "emulator/record/mcap_records.hpp"
#include "emulator/record/recording.hpp"

namespace lk::emulator {
namespace {

namespace fs = std::filesystem;
using mcap::Op;

/// Longer than any record of a recording: a chunk, or a configuration.
constexpr std::uint64_t kLongestRecord = std::uint64_t{64} << 20U;
constexpr std::size_t kRecordHead = 9;  // op code, length

struct Damaged : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Reads fields from the front of a record. Throws Damaged where it ends too early.
class Fields {
 public:
  explicit Fields(std::string_view bytes) : rest_(bytes) {}
  bool empty() const { return rest_.empty(); }
  std::string_view take(std::uint64_t count) {
    if (count > rest_.size()) throw Damaged("a record ends too early");
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return taken;
  }
  template <typename Integer>
  Integer number() {
    std::uint64_t value = 0;
    const std::string_view bytes = take(sizeof(Integer));
    for (std::size_t n = sizeof(Integer); n-- > 0;) {
      value = value << 8U | static_cast<std::uint8_t>(bytes[n]);
    }
    return static_cast<Integer>(value);
  }
  std::string_view text() { return take(number<std::uint32_t>()); }
  std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

/// recording.json, config.toml, a file in motors or rom; no other place.
bool is_of_recording(std::string_view name) {
  if (name == kRecordingFile || name == "config.toml") return true;
  for (const std::string_view part : {"motors/", "rom/"}) {
    if (!name.starts_with(part)) continue;
    const std::string_view file = name.substr(part.size());
    return file.ends_with(".toml") && file.find('/') == std::string_view::npos &&
           file.find('\0') == std::string_view::npos;
  }
  return false;
}

class Unpacking {
 public:
  explicit Unpacking(const fs::path& directory)
      : directory_(directory),
        inputs_(directory / kInputsFile, std::ios::binary),
        frames_(directory / kFramesFile, std::ios::binary) {
    for (const char* part : {"motors", "rom"}) fs::create_directory(directory / part);
  }

  void take(Op op, std::string_view content) {
    Fields fields(content);
    if (op == Op::kSchema) {
      const auto id = fields.number<std::uint16_t>();
      schemas_[id] = fields.text();
    } else if (op == Op::kChannel) {
      const auto id = fields.number<std::uint16_t>();
      channels_[id] = schemas_[fields.number<std::uint16_t>()];
    } else if (op == Op::kMessage) {
      take_message(fields);
    } else if (op == Op::kChunk) {
      take_chunk(fields);
    } else if (op == Op::kAttachment) {
      take_attachment(content);
    }
  }
  bool is_recording() const { return is_recording_; }
  /// All of it could be written.
  bool finish() {
    inputs_.close();
    frames_.close();
    return inputs_.good() && frames_.good() && written_;
  }

 private:
  void take_message(Fields& fields) {
    const std::string& schema = channels_[fields.number<std::uint16_t>()];
    fields.take(sizeof(std::uint32_t) + 2 * sizeof(std::uint64_t));
    if (schema == "lk_emu.Directive") {
      inputs_ << fields.rest() << '\n';
    } else if (schema == "lk_emu.Frame") {
      frames_ << parse_json(fields.rest()).at("line").get<std::string>() << '\n';
    }
  }
  void take_chunk(Fields& fields) {
    fields.take(3 * sizeof(std::uint64_t));
    const auto crc = fields.number<std::uint32_t>();
    if (!fields.text().empty()) throw Damaged("its chunks are compressed");
    const std::string_view records = fields.take(fields.number<std::uint64_t>());
    if (mcap::crc32(records) != crc) throw Damaged("the sum of a chunk is wrong");
    for (Fields rest(records); !rest.empty();) {
      const auto op = static_cast<Op>(rest.number<std::uint8_t>());
      const std::string_view content = rest.take(rest.number<std::uint64_t>());
      if (op == Op::kChunk) throw Damaged("a chunk is in a chunk");
      take(op, content);
    }
  }
  void take_attachment(std::string_view content) {
    Fields fields(content);
    fields.take(2 * sizeof(std::uint64_t));
    const std::string name(fields.text());
    fields.text();
    const std::string_view data = fields.take(fields.number<std::uint64_t>());
    const auto before = content.substr(0, content.size() - fields.rest().size());
    if (fields.number<std::uint32_t>() != mcap::crc32(before)) {
      throw Damaged("the sum of " + name + " is wrong");
    }
    if (!is_of_recording(name)) return;
    std::ofstream file(directory_ / name, std::ios::binary);
    file << data;
    file.close();
    written_ = written_ && file.good();
    is_recording_ = is_recording_ || name == kRecordingFile;
  }

  fs::path directory_;
  std::ofstream inputs_;
  std::ofstream frames_;
  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, std::string> channels_;  // their schemas
  bool is_recording_ = false;
  bool written_ = true;
};

/// Up to the end of the data, or of what is there.
void read_records(std::istream& in, Unpacking& unpacking) {
  std::array<char, kRecordHead> head{};
  std::string content;
  while (in.read(head.data(), head.size())) {
    Fields fields({head.data(), head.size()});
    const auto op = static_cast<Op>(fields.number<std::uint8_t>());
    const auto length = fields.number<std::uint64_t>();
    if (op == Op::kDataEnd || op == Op::kFooter) return;
    if (length > kLongestRecord) throw Damaged("a record is longer than any of a recording");
    content.resize(length);
    if (!in.read(content.data(), static_cast<std::streamsize>(length))) return;
    unpacking.take(op, content);
  }
}

}  // namespace

void unpack_mcap(const fs::path& file, const fs::path& directory) {
  const auto fail = [&](const std::string& why) { throw StartError(file.string() + ": " + why); };
  try {
    open_regular_file(file);
    std::ifstream in(file, std::ios::binary);
    std::array<char, mcap::kMagic.size()> magic{};
    if (!in.read(magic.data(), magic.size()) ||
        std::string_view(magic.data(), magic.size()) != mcap::kMagic) {
      fail("not an MCAP file");
    }
    Unpacking unpacking(directory);
    read_records(in, unpacking);
    if (!unpacking.is_recording()) {
      fail(std::string("not a recording of lk-emu: it has no ") + kRecordingFile + " in it");
    }
    if (!unpacking.finish()) fail("cannot be unpacked into " + directory.string());
  } catch (const Damaged& problem) {
    fail(problem.what());
  } catch (const JsonError& problem) {
    fail(std::string("a message is not as lk-emu writes it: ") + problem.what());
  } catch (const Json::exception& problem) {
    fail(std::string("a message is not as lk-emu writes it: ") + problem.what());
  } catch (const std::invalid_argument& problem) {
    throw StartError(problem.what());
  } catch (const fs::filesystem_error& problem) {
    fail(problem.code().message());
  }
}

}  // namespace lk::emulator
