#include "emulator/config/motor_file.hpp"

#include <filesystem>
#include <optional>
#include <utility>

#include "emulator/config/config.hpp"
#include "emulator/config/motor_document.hpp"

namespace lk::emulator {
namespace {

/// "./a/./b" becomes "a/b". A ".." stays, as it may follow a symbolic link.
std::string plain(const std::string& path) {
  std::filesystem::path kept;
  for (const auto& part : std::filesystem::path(path)) {
    if (part != ".") kept /= part;
  }
  return kept.generic_string();
}

/// Keys that are not inherited: trade names, and facts known only of the other motor.
constexpr const char* kOfOneMotor[] = {"extends", "aliases", "rating", "product",
                                       "seen_generation"};

/// Returns the motor file that `document` extends; nullopt if none.
std::optional<MotorFile> base_of(const toml::table& document, const std::string& file,
                                 const std::vector<std::string>& files,
                                 const FindMotorFile& find_base) {
  TableReader reader(document, file, "");
  const auto motor = reader.text("extends");
  if (!motor) return std::nullopt;
  if (!find_base) reader.fail("extends", "no other motor files are at hand here");
  MotorFile base;
  try {
    base = find_base(motor_of(file, *motor));
  } catch (const UnknownMotor& problem) {
    reader.fail("extends", problem.what());
  }
  for (const std::string& other : files) {
    if (plain(other) == plain(base.file)) {
      reader.fail("extends", other + " would extend itself");
    }
  }
  if (files.size() >= kMostMotorFiles) {
    reader.fail("extends", "more than " + std::to_string(kMostMotorFiles) +
                               " motor files, each extending the next, or a loop of them");
  }
  return base;
}

/// Moves missing values from `base` to `table`; a moved value keeps its source line.
void take_over(toml::table& table, toml::table& base) {
  for (auto&& [key, inherited] : base) {
    toml::node* const own = table.get(key);
    if (own == nullptr) {
      inherited.visit([&, &name = key](auto& value) { table.insert(name, std::move(value)); });
    } else if (own->is_table() && inherited.is_table()) {
      take_over(*own->as_table(), *inherited.as_table());
    }
  }
}

/// Rejects inheritance between series, which differ too much.
void check_series(const toml::table& document, const std::string& file, const toml::table& base) {
  const auto own = document["series"].value<std::string>();
  const auto inherited = base["series"].value<std::string>();
  if (!own || !inherited || *own == *inherited) return;
  TableReader(document, file, "").fail("series", "the motor that it extends is an " + *inherited);
}

}  // namespace

bool is_path(const std::string& given) {
  return given.find('/') != std::string::npos || given.ends_with(".toml");
}

std::string motor_of(const std::string& file, const std::string& motor) {
  const std::size_t slash = file.rfind('/');
  const bool whole = std::filesystem::path(motor).has_root_directory();
  if (!is_path(motor) || whole || slash == std::string::npos) return motor;
  const std::string path = plain(file.substr(0, slash + 1) + motor);
  return is_path(path) ? path : "./" + path;
}

std::vector<std::string> motor_labels(const std::string& text, const std::string& file) {
  const toml::table document = parse_toml(text, file);
  TableReader reader(document, file, "");
  std::vector<std::string> labels;
  if (const auto model = reader.text("model")) labels.push_back(*model);
  for (const std::string& alias : reader.texts("aliases")) labels.push_back(alias);
  return labels;
}

MotorDocument read_motor_document(const MotorFile& motor, const FindMotorFile& find_base) {
  std::vector<toml::table> tables;  // moved into, as a copy would lose the source lines
  tables.push_back(parse_toml(motor.text, motor.file));
  std::vector<std::string> files{motor.file};
  while (const auto base = base_of(tables.back(), files.back(), files, find_base)) {
    tables.push_back(parse_toml(base->text, base->file));
    files.push_back(base->file);
  }
  for (std::size_t n = tables.size() - 1; n > 0; --n) {
    check_series(tables[n - 1], files[n - 1], tables[n]);
    for (const char* own : kOfOneMotor) tables[n].erase(own);
    take_over(tables[n - 1], tables[n]);
  }
  return {std::move(tables.front()), std::move(files)};
}

}  // namespace lk::emulator
