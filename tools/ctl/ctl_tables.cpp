#include "tools/ctl/ctl_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <vector>

namespace lk::emulator {
namespace {

double number(const Json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_number() ? found->get<double>() : 0;
}

std::string word(const Json& json, const char* key) { return json.value(key, std::string()); }

std::string joined(const Json& list, const char* nothing) {
  std::string all;
  for (const Json& one : list) {
    if (!all.empty()) all += ',';
    all += one.is_string() ? one.get<std::string>() : one.dump();
  }
  return all.empty() ? nothing : all;
}

std::string when(const Json& fault, const char* key) {
  const auto found = fault.find(key);
  return found != fault.end() && found->is_number() ? fmt::format("{:.3f}", found->get<double>())
                                                    : "-";
}

std::string activity(const Json& status, const char* key) {
  const auto found = status.find(key);
  return found == status.end() || found->is_null() ? ""
                                                   : fmt::format("{}: {}\n", key, found->dump());
}

std::string values(const Json& object, const std::string& indent) {
  std::string text;
  for (const auto& [key, value] : object.items()) {
    if (value.is_object()) {
      text += fmt::format("{}{}\n", indent, key) + values(value, indent + "  ");
    } else {
      const std::string shown =
          value.is_number_float() ? fmt::format("{:.6g}", value.get<double>()) : value.dump();
      text += fmt::format("{}{:<24} {}\n", indent, key, shown);
    }
  }
  return text;
}

/// Formats each advice as a block: `what` is the key of the text, `todo` of the remedy below it.
std::string advice_blocks(const Json& advice, const char* what, const char* todo) {
  std::string text;
  for (const Json& one : advice) {
    const auto drive = number(one, "drive");
    text += fmt::format("{}{}  {}  {} x, {:.6g} s  {}\n  {}\n  -> {}\n", word(one, "bus"),
                        drive > 0 ? fmt::format(":{}", drive) : "", word(one, "kind"),
                        number(one, "count"), number(one, "first_s"), word(one, "frame"),
                        word(one, what), word(one, todo));
  }
  return text;
}

/// Returns text like "ID 9, can, RS-485 115200 bit/s, CAN 500000 bit/s".
std::string place_text(const Json& place) {
  return fmt::format("ID {}, {}, RS-485 {} bit/s, CAN {} bit/s", number(place, "id"),
                     word(place, "bus_type"), number(place, "rs485_rate"),
                     number(place, "can_rate"));
}

/// Formats a line for each drive whose ID, bus or rates differ from the configuration, now or after
/// the next start of the drive.
std::string address_change_lines(const Json& bus) {
  std::string text;
  for (const Json& drive : bus.value("moved", Json::array())) {
    const Json& place = drive["place"];
    const std::string others = joined(place.value("shared_with", Json::array()), "");
    text += fmt::format("{}: drive {} is at {}{}{}; after its next start at {}", word(bus, "bus"),
                        number(drive, "id"), place_text(place),
                        place.value("heard", true) ? "" : " and receives nothing here",
                        others.empty() ? "" : ", as drive " + others + " is",
                        place_text(place["saved"]));
    if (!place["pending"].is_null()) {
      text += fmt::format("; not saved: {}", place_text(place["pending"]));
    }
    text += '\n';
  }
  return text;
}

/// Returns the rows with aligned columns and two spaces between them. A '>' in `right` marks a
/// column that is aligned to the right. The last column is not padded.
std::string table(const std::vector<std::vector<std::string>>& rows, std::string_view right) {
  std::vector<std::size_t> widths(right.size());
  for (const auto& row : rows) {
    for (std::size_t n = 0; n < widths.size(); ++n) widths[n] = std::max(widths[n], row[n].size());
  }
  std::string text;
  for (const auto& row : rows) {
    for (std::size_t n = 0; n < widths.size(); ++n) {
      const bool last = n + 1 == widths.size();
      if (right[n] == '>') {
        text += fmt::format("{:>{}}", row[n], widths[n]);
      } else {
        text += last ? row[n] : fmt::format("{:<{}}", row[n], widths[n]);
      }
      text += last ? "\n" : "  ";
    }
  }
  return text;
}

std::string counted(const Json& json, const char* key) {
  return fmt::format("{}", number(json, key));
}

/// The hosts' side of a bus: queue and error counters, if anything is or was wrong.
std::string host_side_line(const Json& bus) {
  const Json& counters = bus["counters"];
  if (!bus.contains("host") || !bus["host"].is_object() ||
      (counters["unacknowledged"] == 0 && bus["host"]["bus_off"] == false))
    return "";
  const Json& host = bus["host"];
  const char* state = host["bus_off"] == true        ? "bus-off"
                      : host["acknowledged"] == true ? "acknowledged"
                                                     : "not acknowledged";
  return fmt::format(
      "{}: host {}, queue {} of {}, transmit errors {}, receive errors {}, replayed {}, of these "
      "stale {}\n",
      word(bus, "bus"), state, counted(counters, "frames_waiting"), counted(host, "tx_queue"),
      counted(host, "transmit_errors"), counted(host, "receive_errors"),
      counted(counters, "replayed"), counted(counters, "stale"));
}

}  // namespace

std::string status_table(const Json& status) {
  const Json& clock = status["clock"];
  std::string text =
      fmt::format("lk-emu {}, pid {}\nclock: {}, {:.6f} s, slipped {:.3f} s\n",
                  word(status, "version"), number(status, "pid"), word(clock, "mode"),
                  number(clock, "time_s"), number(clock, "slipped_s"));
  text += activity(status, "recording") + activity(status, "scenario");
  std::vector<std::vector<std::string>> rows = {
      {"bus", "ids", "up", "frames", "queries", "replies", "lost", "waiting"}};
  for (const Json& bus : status["buses"]) {
    const Json& counters = bus["counters"];
    rows.push_back({word(bus, "bus"), joined(bus["ids"], "-"),
                    bus.value("up", false) ? "yes" : "no", counted(counters, "frames"),
                    counted(counters, "queries"), counted(counters, "replies"),
                    counted(counters, "replies_lost"), counted(counters, "waiting_for_time")});
  }
  text += table(rows, "<<<>>>>>");
  for (const Json& bus : status["buses"]) text += host_side_line(bus) + address_change_lines(bus);
  return text;
}

std::string drives_table(const Json& drives) {
  std::vector<std::vector<std::string>> rows = {
      {"bus", "id", "motor", "state", "angle_deg", "speed_dps", "iq_A", "V", "C", "errors"}};
  for (const Json& drive : drives) {
    const Json& signals = drive["signals"];
    const bool alive = drive.value("alive", false);
    // Fixed widths, because `watch` redraws the table.
    rows.push_back({word(drive, "bus"), counted(drive, "id"), word(drive, "motor"),
                    fmt::format("{:<8}", alive ? word(drive, "state") : "no power"),
                    fmt::format("{:>9.2f}", number(signals, "angle_deg")),
                    fmt::format("{:>9.1f}", number(signals, "speed_dps")),
                    fmt::format("{:>7.3f}", number(signals, "iq_A")),
                    fmt::format("{:.1f}", number(signals, "voltage_V")),
                    fmt::format("{:.1f}", number(signals, "temperature_C")),
                    joined(drive["errors"], "-")});
  }
  return table(rows, "<><<>>>>><");
}

std::string drive_page(const Json& drive) {
  std::string text = fmt::format(
      "{}:{} {} ({}, {}), {}, {}, errors: {}\n", word(drive, "bus"), number(drive, "id"),
      word(drive, "model"), word(drive, "series"), word(drive, "generation"), word(drive, "state"),
      drive.value("alive", false) ? "alive" : "no power", joined(drive["errors"], "none"));
  return text + "signals\n" + values(drive["signals"], "  ") + "settings in RAM\n" +
         values(drive["registers"]["ram"], "  ") + "counters\n" + values(drive["counters"], "  ");
}

std::string faults_table(const Json& faults) {
  if (faults.empty()) return "no faults\n";
  std::vector<std::vector<std::string>> rows = {
      {"bus", "name", "kind", "ids", "state", "began_s", "effect_s", "effects", "first on"}};
  for (const Json& fault : faults) {
    rows.push_back({word(fault, "bus"), word(fault, "name"), word(fault, "kind"),
                    joined(fault["ids"], "bus"), word(fault, "state"), when(fault, "began_at_s"),
                    when(fault, "first_effect_at_s"), counted(fault, "effects"),
                    word(fault, "first_on")});
  }
  return table(rows, "<<<<<>>><");
}

std::string recording_line(const Json& recording) {
  return fmt::format("recording into {}\n", word(recording, "directory"));
}

std::string recorded_line(const Json& recording) {
  const bool failed = recording.value("failed", false);
  return fmt::format("recorded into {}{}\n", word(recording, "directory"),
                     failed ? ", until the disk refused" : "");
}

std::string scenario_page(const Json& scenario) {
  std::string text =
      fmt::format("{}: {}, {:.3f} of {:.6g} s\n", word(scenario, "name"), word(scenario, "state"),
                  number(scenario, "time_s"), number(scenario, "duration_s"));
  for (const Json& one : scenario.value("expectations", Json::array())) {
    text += fmt::format("  {:<6}  {} - {}\n", word(one, "status"), word(one, "expected"),
                        word(one, "measured"));
    if (!word(one, "says").empty()) text += fmt::format("          {}\n", word(one, "says"));
  }
  for (const Json& fault : scenario.value("faults", Json::array())) {
    text += fmt::format("  fault   {}\n", word(fault, "evidence"));
  }
  for (const Json& reason : scenario.value("invalid", Json::array())) {
    text += fmt::format("  invalid: {}\n", reason.get<std::string>());
  }
  return text;
}

std::string advice_table_en(const Json& advice) {
  return advice.empty() ? "no advice\n" : advice_blocks(advice, "what", "todo");
}

std::string advice_table_zh(const Json& advice) {
  return advice.empty() ? "没有建议\n" : advice_blocks(advice, "what_zh", "todo_zh");
}

}  // namespace lk::emulator
