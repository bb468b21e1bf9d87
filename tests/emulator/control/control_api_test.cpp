#include "emulator/io/control/control_api.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <set>

#include "emulator/core/faults/fault_table.hpp"
#include "emulator/monitor/frames/frame_words.hpp"
#include "tests/emulator/control/control_support.hpp"
#include "tests/support/serial_bus.hpp"

namespace lk::emulator {
namespace control_api_test {

TEST(ControlApi, ReportsStatusAndDrives) {
  TestWorld t;
  const ApiResponse status = t.get("/status");
  EXPECT_EQ(status.status, 200);
  EXPECT_EQ(status.body["clock"]["mode"], "stepped");
  EXPECT_EQ(status.body["clock"]["time_s"], 0);
  EXPECT_EQ(status.body["buses"][0]["bus"], "vcan0");
  EXPECT_EQ(status.body["buses"][0]["ids"], Json({1, 2}));
  EXPECT_TRUE(status.body["recording"].is_null());
  EXPECT_EQ(t.get("/drives").body.size(), 2U);
  const ApiResponse drive = t.get("/drives/vcan0/2");
  EXPECT_EQ(drive.body["id"], 2);
  EXPECT_EQ(drive.body["state"], "running");
  EXPECT_EQ(drive.body["signals"].size(), signals().size());
  EXPECT_EQ(drive.body["registers"]["ram"], drive.body["registers"]["rom"]);
  EXPECT_EQ(t.get("/faults/kinds").body.size(), fault_table().size());
  EXPECT_EQ(t.get("/signals").body.size(), signals().size());
}

TEST(ControlApi, SendsChosenFieldsOfDrives) {
  TestWorld t;
  const auto drives = [&t](const std::map<std::string, std::string>& query) {
    return t.ask({"GET", "/api/v1/drives", query, "", ""});
  };
  EXPECT_EQ(drives({{"fields", "id,state"}}).body,
            Json({{{"id", 1}, {"state", "running"}}, {{"id", 2}, {"state", "running"}}}));
  EXPECT_EQ(drives({{"fields", "id,nam"}}).body["error"]["reason"], "unknown field \"nam\"");
  EXPECT_EQ(drives({{"field", "id"}}).status, 400);
}

/// The buses are served before each request, however many requests wait.
TEST(ControlApi, ServesTheBusesBeforeEachRequest) {
  TestWorld t{ClockMode{}};
  for (const char* path : {"/status", "/drives", "/drives/vcan0/1", "/advice", "/faults",
                           "/faults/kinds", "/signals", "/scenarios", "/clock"}) {
    const SimTime before = t.world.time();
    // On a busy machine time may slip instead of advancing, but not each time.
    for (int n = 0; n < 1000 && t.world.time() == before; ++n) {
      EXPECT_EQ(t.get(path).status, 200);
    }
    EXPECT_GT(t.world.time(), before) << path;
  }
}

/// As encoded by the page: names of buses contain colons and slashes.
TEST(ControlApi, DecodesNamesInPaths) {
  TestWorld t;
  EXPECT_EQ(t.get("/drives/vcan%30/2").body["id"], 2);
  EXPECT_EQ(t.get("/drives/vcan0%2F2/2").body["error"]["reason"], "unknown bus vcan0/2");
  EXPECT_EQ(t.get("/drives/vcan%3/2").status, 400);
  EXPECT_EQ(t.get("/drives/%FF/2").status, 404);
}

TEST(ControlApi, RejectsUnknownPathsAndMethods) {
  TestWorld t;
  for (const char* path : {"/", "/drives/vcan0", "/drives/vcan0/3", "/drives/vcan9/1",
                           "/drives/vcan0/1x", "/drives/../status", "/status/", "//status"}) {
    EXPECT_EQ(t.get(path).status, 404) << path;
  }
  for (const char* path : {"/", "/status", "/api/v1", "/api/v1status", "/../etc/passwd"}) {
    EXPECT_EQ(t.ask({"GET", path, {}, "", ""}).status, 404) << path;
  }
  const ApiResponse wrong = t.send("DELETE", "/clock", "");
  EXPECT_EQ(wrong.status, 405);
  EXPECT_EQ(wrong.allow, "GET, HEAD, PUT");
  EXPECT_EQ(t.ask({"POST", "/api/v1/directives", {}, "text/plain", "{}"}).status, 415);
  EXPECT_EQ(
      t.ask(
           {"PUT", "/api/v1/clock", {}, "application/json; charset=utf-8", R"({"mode":"stepped"})"})
          .status,
      200);
}

TEST(ControlApi, RejectsMalformedAndEmptyBodies) {
  TestWorld t;
  for (const char* body : {"", "{", "[]", "7", "null", "{\"a\":}", "{} {}", "\xff\xfe"}) {
    EXPECT_EQ(t.post("/directives", body).status, 400) << body;
  }
  const ApiResponse null = t.post("/directives", R"({"supply_V": null})");
  EXPECT_EQ(null.status, 400);
  EXPECT_EQ(where(null), "supply_V");
  const ApiResponse unknown = t.post("/directives", R"({"suply_V": 3})");
  EXPECT_EQ(unknown.status, 400);
  EXPECT_EQ(where(unknown), "suply_V");
  EXPECT_EQ(t.post("/directives", R"({"id": 3, "supply_V": 3})").status, 400);
  EXPECT_EQ(t.post("/directives", R"({"supply_V": 18446744073709551615})").status, 400);
  EXPECT_EQ(t.post("/clock/advance", R"({"by_s": 1, "to_s": 1})").status, 400);
  EXPECT_EQ(t.post("/clock/advance", R"({"by_s": -1})").status, 400);
}

TEST(ControlApi, RejectsDuplicateKeys) {
  TestWorld t;
  const ApiResponse twice = t.post("/directives", R"({"supply_V": 3, "id": 1, "supply_V": 30})");
  EXPECT_EQ(twice.status, 400);
  EXPECT_EQ(where(twice), "supply_V");
  EXPECT_EQ(reason(twice), "is given twice");
  EXPECT_EQ(where(t.post("/directives", R"({"id": 1, "load": {"J_g_cm2": 1, "J_g_cm2": 2}})")),
            "J_g_cm2");
  // A key that occurs in two different objects is not a duplicate.
  EXPECT_EQ(
      t.post("/directives", R"({"id": 1, "when": {"id": 2, "error": "stall"}, "power": "off"})")
          .status,
      200);
}

TEST(ControlApi, RejectsUnknownQueryParameters) {
  TestWorld t;
  const ApiResponse asked = t.ask({"GET", "/api/v1/status", {{"bus", "vcan0"}}, "", ""});
  EXPECT_EQ(asked.status, 400);
  EXPECT_EQ(where(asked), "bus");
  EXPECT_EQ(t.ask({"PUT", "/api/v1/clock", {{"mode", "x1"}}, "application/json", "{}"}).status,
            400);
}

TEST(ControlApi, RejectsDeepNesting) {
  TestWorld t;
  const auto nested = [](int levels) {
    return std::string(R"({"a":)") + std::string(static_cast<std::size_t>(levels), '[') +
           std::string(static_cast<std::size_t>(levels), ']') + "}";
  };
  EXPECT_EQ(where(t.post("/directives", nested(kDeepestJson + 1))), "body");
  EXPECT_EQ(where(t.post("/directives", nested(kDeepestJson - 2))), "a") << "an unknown key only";
  EXPECT_EQ(where(t.post("/directives", nested(30'000))), "body");
  std::string objects;
  for (int n = 0; n < 10'000; ++n) objects += R"({"a":)";
  EXPECT_EQ(where(t.post("/directives", objects)), "body");
}

TEST(ControlApi, ExecutesDirectives) {
  TestWorld t;
  const ApiResponse done = t.post("/directives", R"({"ids": "1", "supply_V": 18})");
  EXPECT_EQ(done.status, 200) << done.body;
  EXPECT_EQ(done.body["time_s"], 0);
  EXPECT_TRUE(done.body["faults"].empty());
  t.post("/directives", R"({"id": 2, "power": "off"})");
  EXPECT_EQ(t.post("/clock/advance", R"({"by_s": 1})").status, 200);
  EXPECT_NEAR(t.get("/drives/vcan0/1").body["signals"]["true_voltage_V"].get<double>(), 18, 0.1);
  EXPECT_FALSE(t.get("/drives/vcan0/2").body["alive"]) << "its link is empty by now";
  const ApiResponse dead = t.post("/directives", R"({"id": 2, "settings": {"max_speed_dps": 5}})");
  EXPECT_EQ(dead.status, 409);
}

TEST(ControlApi, RejectsPartlyWrongDirectivesEntirely) {
  TestWorld t;
  EXPECT_EQ(t.post("/directives", R"({"power": "off", "off_s": 1})").status, 400);
  EXPECT_EQ(t.post("/directives", R"({"fault": {"kind": "hang", "for": 1}})").status, 400);
  t.post("/clock/advance", R"({"by_s": 1})");
  EXPECT_TRUE(t.get("/drives/vcan0/1").body["alive"]);
  EXPECT_TRUE(t.get("/faults").body.empty());
}

TEST(ControlApi, KeepsOtherSettingsInRam) {
  TestWorld t;
  const auto gains = [&] { return t.get("/drives/vcan0/1").body["registers"]["ram"]["gains"]; };
  t.post("/directives", R"({"id": 1, "settings": {"gains": {"speed_kp": 11}}})");
  t.post("/directives", R"({"id": 1, "settings": {"gains": {"speed_ki": 12}}})");
  EXPECT_EQ(gains()["speed_kp"], 11) << "not what the configuration says";
  EXPECT_EQ(gains()["speed_ki"], 12);
}

/// Time stands still, so the drive's flash makes no progress; it holds 16 writes (CanWire).
TEST(ControlApi, RejectsSettingWhenTheFlashQueueIsFull) {
  TestWorld t;
  const auto set = [&](const char* ids, int kp) {
    return t.post("/directives", R"({"ids": ")" + std::string(ids) +
                                     R"(", "settings": {"gains": {"speed_kp": )" +
                                     std::to_string(kp) + "}}}");
  };
  const auto kp_of = [&](int id) {
    const Json drive = t.get("/drives/vcan0/" + std::to_string(id)).body;
    return drive["registers"]["ram"]["gains"]["speed_kp"].get<int>();
  };
  for (int n = 1; n <= 16; ++n) ASSERT_EQ(set("2", n).status, 200) << n;
  const int before = kp_of(1);
  const ApiResponse full = set("1-2", 99);
  EXPECT_EQ(full.status, 409);
  EXPECT_EQ(where(full), "settings");
  EXPECT_EQ(kp_of(1), before) << "all drives that are meant, or none";
  EXPECT_EQ(kp_of(2), 16);
  EXPECT_EQ(t.post("/clock/advance", R"({"by_s": 10})").status, 200);
  EXPECT_EQ(set("1-2", 99).status, 200) << "the flash is idle again";
  EXPECT_EQ(kp_of(2), 99);
}

TEST(ControlApi, NamesFaultsAndClearsThem) {
  TestWorld t;
  const auto inject = [&] { return t.post("/directives", R"({"ids": "1-2", "fault": "hang"})"); };
  EXPECT_EQ(inject().body["faults"], Json({"hang"}));
  EXPECT_EQ(inject().body["faults"], Json({"hang-2"}));
  const Json faults = t.get("/faults").body;
  ASSERT_EQ(faults.size(), 2U);
  EXPECT_EQ(faults[0]["state"], "active");
  EXPECT_EQ(faults[0]["ids"], Json({1, 2}));
  EXPECT_EQ(faults[0]["began_at_s"], 0);
  EXPECT_TRUE(faults[0]["first_effect_at_s"].is_null());
  EXPECT_EQ(t.post("/directives", R"({"clear": "hung"})").status, 400);
  EXPECT_EQ(t.post("/directives", R"({"clear": "hang-2"})").status, 200);
  EXPECT_EQ(t.get("/faults").body[1]["state"], "cleared");
  EXPECT_EQ(t.post("/directives", R"({"clear": "all"})").status, 200);
}

TEST(ControlApi, LimitsWaitingConditions) {
  TestWorld t;
  const std::string never = R"("when": {"id": 1, "signal": "speed_dps", "above": 1e9})";
  for (std::size_t n = 0; n < Bus::kMaxWaiting; ++n) {
    ASSERT_EQ(t.post("/directives", R"({"id": 1, "turn_deg": 1, )" + never + "}").status, 200) << n;
  }
  // Not executed, not forgotten, and not answered with another one's name.
  EXPECT_EQ(t.post("/directives", R"({"id": 1, "turn_deg": 1, )" + never + "}").status, 409);
  EXPECT_EQ(t.post("/directives", R"({"id": 1, "fault": "jam", )" + never + "}").status, 409);
  EXPECT_TRUE(t.get("/faults").body.empty());
}

TEST(ControlApi, LimitsPlannedDirectives) {
  TestWorld t;
  const auto plan = [&] {
    return t.post("/directives", R"({"ids": "1-2", "turn_deg": 1, "at_s": 3600})").status;
  };
  const auto planned = [&] { return t.get("/status").body["buses"][0]["planned"]; };
  for (std::size_t n = 0; n < kMaxPlanned / 2; ++n) ASSERT_EQ(plan(), 200) << n;
  EXPECT_EQ(planned(), kMaxPlanned);
  EXPECT_EQ(plan(), 409);
  EXPECT_EQ(planned(), kMaxPlanned);
  EXPECT_EQ(t.post("/directives", R"({"id": 1, "turn_deg": 1})").status, 200) << "that is done now";
  EXPECT_EQ(t.post("/directives", R"({"clear": "planned"})").status, 200);
  EXPECT_EQ(planned(), 0);
  EXPECT_EQ(plan(), 200);
  t.post("/directives", R"({"id": 1, "turn_deg": 1, "when": {"error": "stall"}})");
  t.post("/directives", R"({"id": 1, "fault": "jam", "at_s": 3600})");
  EXPECT_EQ(planned(), 3) << "faults are listed with the faults";
  EXPECT_EQ(t.send("DELETE", "/directives", "").status, 200);
  EXPECT_EQ(planned(), 0);
  EXPECT_EQ(t.get("/faults").body[0]["state"], "armed");
}

TEST(ControlApi, RequiresABusNameWithSeveralBuses) {
  TestWorld t({.stepped = true}, 2);
  EXPECT_EQ(where(t.post("/directives", R"({"power": "off"})")), "bus");
  EXPECT_EQ(t.post("/directives", R"({"power": "off", "bus": "vcan1"})").status, 200);
  EXPECT_EQ(t.post("/directives", R"({"power": "off", "bus": "vcan2"})").status, 400);
  EXPECT_EQ(t.post("/directives", R"({"power": "off", "bus": 1})").status, 400);
  EXPECT_EQ(t.post("/clock/advance", R"({"by_s": 0.5})").body["time_s"], 0.5);
  const Json status = t.get("/status").body;
  for (const Json& bus : status["buses"]) EXPECT_EQ(bus["time_s"], 0.5);
  EXPECT_TRUE(t.get("/drives/vcan0/1").body["alive"]);
  EXPECT_FALSE(t.get("/drives/vcan1/1").body["alive"]);
}

TEST(ControlApi, AdvancesASteppedClockOnly) {
  TestWorld t;
  EXPECT_EQ(t.post("/clock/advance", R"({"by_s": 0.0015})").body["time_s"], 0.0015);
  EXPECT_EQ(t.post("/clock/advance", R"({"to_s": 0.25})").body["time_s"], 0.25);
  EXPECT_EQ(t.post("/clock/advance", R"({"to_s": 0.25})").status, 200) << "there already";
  EXPECT_EQ(t.post("/clock/advance", R"({"to_s": 0.1})").status, 400);
  EXPECT_EQ(t.send("PUT", "/clock", R"({"mode": "x0.001"})").status, 200);
  EXPECT_EQ(t.post("/clock/advance", R"({"by_s": 1})").status, 409);
  EXPECT_EQ(t.send("PUT", "/clock", R"({"mode": "fast"})").status, 400);
}

TEST(ControlApi, SetsTheClockByDirective) {
  TestWorld t;
  EXPECT_EQ(t.post("/directives", R"({"clock": "x10"})").status, 200);
  EXPECT_EQ(t.get("/clock").body["mode"], "x10");
  const ApiResponse unknown = t.post("/directives", R"({"clock": "backwards"})");
  EXPECT_EQ(unknown.status, 400);
  EXPECT_EQ(where(unknown), "clock");
  EXPECT_EQ(t.post("/directives", R"({"clock": "stepped", "id": 1})").status, 400);
  EXPECT_EQ(t.get("/clock").body["mode"], "x10");
}

TEST(ControlApi, CancelsALongAdvance) {
  TestWorld t;
  std::optional<ApiResponse> far;
  t.api.handle({"POST", "/api/v1/clock/advance", {}, "application/json", R"({"by_s": 36000})"},
               [&](const ApiResponse& answer) { far = answer; });
  EXPECT_TRUE(t.world.advancing());
  t.loop.run_one();
  EXPECT_FALSE(far) << "one slice is not ten hours";
  EXPECT_EQ(t.post("/clock/advance", R"({"by_s": 1})").status, 409) << "one at a time";
  EXPECT_EQ(t.send("DELETE", "/clock/advance", "").status, 200);
  ASSERT_TRUE(far);
  EXPECT_EQ(far->status, 409);
  const double reached = t.get("/status").body["clock"]["time_s"];
  EXPECT_GT(reached, 0);
  EXPECT_LT(reached, 36000);
  EXPECT_EQ(t.post("/clock/advance", R"({"by_s": 0.001})").status, 200);
}

Json directory_of(TableReader& request, bool /*same_user*/) {
  return {{"directory", request.text("directory").value_or("")}};
}

TEST(ControlApi, RejectsRecordingWithoutRecorder) {
  TestWorld t;
  EXPECT_EQ(t.post("/recording", R"({"directory": "x"})").status, 501);
  t.api.recording.start = directory_of;
  EXPECT_EQ(t.post("/recording", R"({"directory": "x"})").body["directory"], "x");
}

/// A recording creates a directory at any path that the client names.
TEST(ControlApi, RecordsForSameUserOrTokenHolder) {
  TestWorld t;
  t.api.recording.start = directory_of;
  ApiRequest request{"POST", "/api/v1/recording", {}, "application/json", R"({"directory": "x"})"};
  EXPECT_EQ(t.ask(request).status, 200);
  request.same_user = false;
  request.pages_may_write = true;
  EXPECT_EQ(t.ask(request).status, 403);
  EXPECT_EQ(where(t.ask(request)), "recording");
  request.has_token = true;
  EXPECT_EQ(t.ask(request).status, 200);
}

/// The program may wait for the disk for seconds and answers requests meanwhile.
TEST(ControlApi, RejectsWritesDuringShutdown) {
  TestWorld t;
  int begun = 0;
  const auto begin = [&begun](TableReader&, bool) -> Json { return ++begun; };
  t.api.recording.start = t.api.scenario.start = begin;
  t.world.stop();
  for (const auto& [method, path] :
       std::initializer_list<std::pair<const char*, const char*>>{{"POST", "/recording"},
                                                                  {"POST", "/scenario"},
                                                                  {"POST", "/clock/advance"},
                                                                  {"PUT", "/clock"},
                                                                  {"POST", "/directives"}}) {
    const ApiResponse answer = t.send(method, path, R"({"by_s": 1})");
    EXPECT_EQ(answer.status, 503) << path;
    EXPECT_EQ(reason(answer), "the program is ending") << path;
  }
  EXPECT_EQ(begun, 0);
  EXPECT_EQ(t.get("/status").status, 200) << "it can be looked at";
}

TEST(Telemetry, ChecksRequestParameters) {
  TestWorld t;
  const auto ask = [&](std::map<std::string, std::string> query) {
    return t.ask({"GET", "/api/v1/telemetry", std::move(query), "", ""}).status;
  };
  EXPECT_EQ(ask({}), 426);
  EXPECT_EQ(ask({{"rate_Hz", "20000"}, {"signals", "speed_dps"}, {"ids", "2"}}), 426);
  for (const char* rate : {"0", "-1", "0.09", "20001", "nan", "1e999", "x", ""}) {
    EXPECT_EQ(ask({{"rate_Hz", rate}}), 400) << rate;
  }
  EXPECT_EQ(ask({{"ids", "3"}}), 400);
  EXPECT_EQ(ask({{"ids", "0-99"}}), 400);
  EXPECT_EQ(ask({{"signals", ""}}), 400);
  EXPECT_EQ(ask({{"signals", "speed_dps,speed_dps"}}), 400);
  EXPECT_EQ(ask({{"color", "red"}}), 400);
  std::string all;
  for (const Signal& signal : signals()) all += (all.empty() ? "" : ",") + std::string(signal.name);
  EXPECT_EQ(ask({{"signals", all}, {"rate_Hz", "20000"}}), 400) << "too many values a second";
  for (const char* digits : {"0", "18", "3.5"}) EXPECT_EQ(ask({{"digits", digits}}), 400) << digits;
}

TEST(FrameWords, NameTheProblemOfAFrame) {
  const FrameReader reader(test::bus_config({1, 2}, 1'000'000));
  protocol::Frame frame;
  frame.id = 0x141;
  frame.dlc = 8;
  frame.data[0] = 0x7E;
  EXPECT_EQ(reader.query(frame).problem, "unknown command");
  EXPECT_EQ(reader.query(frame).mark, "unknown");
  frame.data[0] = 0x9A;
  EXPECT_EQ(reader.query(frame).name, "read state 1");
  EXPECT_EQ(reader.query(frame).mark, "");
  frame.id = 0x145;
  EXPECT_EQ(reader.query(frame).problem, "no such drive");
  frame.dlc = 7;
  EXPECT_EQ(reader.query(frame).problem, "wrong length");
  frame.id = 0x7DF;
  EXPECT_EQ(reader.query(frame).problem, "no drive's identifier");
  EXPECT_EQ(reader.query(frame).id, 0);
}

/// docs/reference/protocol.md: 0x280 carries four currents of 16 bits; a state 1 with an error bit.
TEST(FrameWords, DecodeQueriesAndReplies) {
  const FrameReader reader(test::bus_config({1, 2}, 1'000'000));
  protocol::Frame frame;
  frame.id = 0x280;
  frame.dlc = 8;
  EXPECT_EQ(reader.query(frame).command, "280");
  EXPECT_EQ(reader.query(frame).values, "1 0, 2 0, 3 0, 4 0");
  frame.id = 0x142;
  frame.data = {0x9A, 25, 0, 240, 0, 0, 0, 0x01};
  const FrameWords state = reader.reply(frame);
  EXPECT_EQ(state.id, 2);
  EXPECT_EQ(state.mark, "error");
  EXPECT_EQ(state.values, "temperature_C 25, voltage_V 24, errors 1: under_voltage");
}

/// docs/reference/protocol.md: MS lacks 0x280, and only v236 has 0x281.
TEST(FrameWords, DecodeByADriveThatKnowsTheCommand) {
  BusConfig bus = test::bus_config({});
  bus.servos = {test::drive(Generation::kLegacy, Series::kMs, 1),
                test::drive(Generation::kV236, Series::kMf, 2)};
  const FrameReader reader(bus);
  EXPECT_EQ(reader.query(test::frame("280#0000000000000000")).values, "1 0, 2 0, 3 0, 4 0");
  EXPECT_EQ(reader.query(test::frame("281#0100000000000000")).values, "1 1, 2 0, 3 0, 4 0");
}

TEST(ControlApi, ReportsAdvice) {
  TestWorld t;
  EXPECT_EQ(t.get("/advice").body, Json::array());
  Line& line = *t.world.lines().front();
  std::vector<std::string> told;
  line.on_advice = [&](const Advice& advice) {
    told.push_back(advice_line(line.name(), advice, Language::kEnglish));
  };
  line.enqueue({SimTime{0}, test::frame("142#9A")});
  line.enqueue({SimTime{0}, test::frame("142#9A0000")});
  line.enqueue({SimTime{0}, test::frame("141#9A00000000000000")});
  EXPECT_EQ(t.post("/clock/advance", R"({"by_s": 0.01})").status, 200);
  const Json advice = t.get("/advice").body;
  ASSERT_EQ(advice.size(), 1U);
  EXPECT_EQ(advice[0]["kind"], "wrong-length");
  EXPECT_EQ(advice[0]["drive"], 2);
  EXPECT_EQ(advice[0]["bus"], "vcan0");
  EXPECT_EQ(advice[0]["count"], 2);
  EXPECT_EQ(advice[0]["first_s"], 0);
  EXPECT_EQ(advice[0]["frame"], "142#9A");
  EXPECT_EQ(advice[0]["what"], "1 of 8 bytes: the drive does not answer");
  EXPECT_EQ(advice[0]["todo_zh"], "每帧的长度要与命令相符：CAN 上都是 8 个字节，不用的字节填 0");
  ASSERT_EQ(told.size(), 1U) << "once, however often it happens";
  EXPECT_EQ(line.adviser().mark_of(2), "wrong-length");
  EXPECT_EQ(line.adviser().mark_of(3), "");
}

/// Words of a scenario's [[send]]; bytes by hand from docs/reference/protocol.md §3.
TEST(ControlApi, SendsHostFrames) {
  TestWorld t;
  Line& line = *t.world.lines().front();
  const ApiResponse sent =
      t.post("/frames", R"({"command": "position_2", "angle_deg": 90, "ids": "1-2"})");
  ASSERT_EQ(sent.status, 200) << sent.body.dump();
  EXPECT_EQ(sent.body["frames"], Json::array({"141#A400000028230000", "142#A400000028230000"}));
  EXPECT_EQ(t.post("/frames", R"({"frame": "141#9C00000000000000"})").status, 200);
  EXPECT_EQ(line.bus().stats().frames, 3U);
  EXPECT_EQ(line.adviser().query_count(), 3U) << "as any host's";
  EXPECT_EQ(where(t.post("/frames", R"({"command": "torque"})")), "iq_A");
  EXPECT_EQ(where(t.post("/frames", R"({"command": "0x31", "id": 1})")), "angle_kp");
  EXPECT_EQ(where(t.post("/frames", R"({"command": "off", "every_s": 1})")), "every_s");
  EXPECT_EQ(t.post("/frames", R"({"command": "off", "bus": "vcan7"})").status, 400);
  EXPECT_EQ(line.bus().stats().frames, 3U) << "nothing is sent of what is refused";
}

TEST(ControlApi, SendsFramesOfTheSameInstantOneByOneOnRs485) {
  BusConfig config = test::serial_bus(
      {test::serial_drive(Generation::kV236, 1), test::serial_drive(Generation::kV236, 2)});
  config.interface = "rs485:/arm";
  TestWorld t(config);
  const Line& line = *t.world.lines().front();
  for (int n = 0; n < 32; ++n) {
    EXPECT_EQ(t.post("/frames", R"({"command": "speed", "speed_dps": 90, "ids": "1-2"})").status,
              n < 31 ? 200 : 409);
    if (n == 1) EXPECT_EQ(line.backlog(), 3U) << "the first frame is on the wire";
    if (n == 30) EXPECT_EQ(t.post("/frames", R"({"command": "stop"})").status, 200);
  }
  EXPECT_EQ(t.post("/clock/advance", R"({"by_s": 0.1})").status, 200);
  EXPECT_EQ(line.bus().stats().frames, 64U);
  EXPECT_EQ(line.bus().servo(1).stats.replies, 32U);
  EXPECT_EQ(line.bus().servo(2).stats.replies, 32U);
  EXPECT_EQ(t.get("/advice").body, Json::array());
}

/// The table of requests and the router's table have the same requests.
TEST(ControlPage, ListsExactlyTheRoutes) {
  std::ifstream page(LKEMU_SOURCE_DIR "/docs/reference/control-api.md");
  const std::regex request("^\\| `((?:GET|POST|PUT|DELETE) /[^`?]*)");
  std::set<std::string> documented;
  std::smatch found;
  for (std::string line; std::getline(page, line);) {
    if (std::regex_search(line, found, request)) documented.insert(found[1]);
  }
  std::set<std::string> routed;
  for (const auto& route : ControlApi::routes()) {
    routed.insert(std::string(route.method) + " " + std::string(route.path));
  }
  EXPECT_EQ(documented, routed);
}

}  // namespace control_api_test
}  // namespace lk::emulator
