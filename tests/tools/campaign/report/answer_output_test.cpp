#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "report_support.hpp"
#include "tools/campaign/report/answer_json.hpp"
#include "tools/campaign/report/answer_junit.hpp"
#include "tools/campaign/report/answer_page.hpp"
#include "tools/campaign/report/answer_text.hpp"

namespace lk::emulator {
namespace {

using std::chrono::milliseconds;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kNasty = "</script><script>alert(1)</script>\x1b[2J\n\"&'<!--\xff";

Answer sample(Sampling sampling = Sampling::kRandom) {
  CaseResult wrong = planted_case(4, "jam", CaseOutcome::kSilentlyWrong);
  wrong.violated = "the forearm stands still";
  wrong.violated_at = milliseconds(2100);
  wrong.margin = -0.25;
  wrong.note = "exit status 3";
  Answer answer =
      answer_of(planted_head(sampling),
                stream_of({detected_case(0, "jam", CaseOutcome::kDetectedByDrive, milliseconds(10)),
                           detected_case(1, "jam", CaseOutcome::kDetectedByHost, milliseconds(30)),
                           planted_case(2, "jam", CaseOutcome::kTolerated), wrong,
                           planted_case(5, "drop", CaseOutcome::kNotFired)}));
  answer.smallest.push_back(
      {"jam", CaseOutcome::kSilentlyWrong, wrong, "<svg/>", "lk-emu run --scenario small.toml"});
  return answer;
}

Answer nasty_sample() {
  CampaignHead head = planted_head();
  head.plan_name = head.about = head.plan_text = head.version = kNasty;
  head.dimensions[0].words = {kNasty};
  CaseResult result = planted_case(0, kNasty, CaseOutcome::kCrash);
  result.violated = result.note = result.state = result.command = kNasty;
  Answer answer = answer_of(head, stream_of({result}));
  answer.smallest.push_back({kNasty, CaseOutcome::kCrash, result, kNasty, kNasty});
  return answer;
}

// Nobody knows what a host program had commanded.
TEST(AnswerText, OfAHostProgramHasNoSpaceAndSaysWhatTheHostSaid) {
  CaseResult crash = planted_case(4, "jam", CaseOutcome::kCrash);
  crash.state = crash.command = "";
  crash.note = "exit status 3";
  crash.said = "no reply";
  const Answer answer = answer_of(planted_head(), stream_of({crash}));
  EXPECT_THAT(answer_text(answer, {}),
              AllOf(Not(HasSubstr("space:")), HasSubstr("; exit status 3; no reply\n")));
  const auto json = nlohmann::json::parse(answer_json(answer, {}));
  EXPECT_TRUE(json["space"].is_null());
  const auto& columns = json["residual"]["columns"];
  const auto note =
      static_cast<std::size_t>(std::find(columns.begin(), columns.end(), "note") - columns.begin());
  EXPECT_EQ(json["residual"]["rows"][0][note], "exit status 3; no reply");
}

TEST(AnswerText, SaysWhatCame) {
  const std::string text = answer_text(sample(), {{"late<=0", true, 0}, {"crash<=0", false, 1}});
  EXPECT_THAT(text, HasSubstr("every_fault: A joint under every kind of fault\n"
                              "5 of 1000 cases, sampling random, seed 1, tolerant time 0.2 s"));
  // 2 of 3: 0.0943 to 0.9916 in the tables
  EXPECT_THAT(
      text,
      HasSubstr(
          "2 of 3 dangerous cases were detected in time, 0.6667, 95 % interval 0.0943 to 0.9916"));
  EXPECT_THAT(text, HasSubstr("to claim 90 %: 51 more dangerous cases"));  // 54 with one miss
  EXPECT_THAT(text, HasSubstr("by the drive: 1 case, p50 0.01 s, p99 0.01 s, worst 0.01 s"));
  EXPECT_THAT(text, HasSubstr("1 of 9 combinations"));  // jam, running, A4; of 3 · 3 · 1
  EXPECT_THAT(text, HasSubstr("case 4: jam, silently wrong, \"the forearm stands still\" failed at "
                              "2.1 s (fault.for_s=0.1); exit status 3\n"
                              "      lk-emu campaign every_fault.toml --case 4\n"));
  EXPECT_THAT(text, HasSubstr("lk-emu run --scenario small.toml"));
  EXPECT_THAT(text, HasSubstr("holds: late<=0: measured 0\nFAILS: crash<=0: measured 1\n"));
}

TEST(AnswerText, OtherSamplingsClaimNothing) {
  EXPECT_THAT(answer_text(sample(Sampling::kPairwise), {}),
              AllOf(HasSubstr("no claim: bounds need sampling = \"random\", not \"pairwise\""),
                    Not(HasSubstr("interval"))));
}

TEST(AnswerText, NothingReachesTheTerminalUnfiltered) {
  const std::string text = answer_text(nasty_sample(), {{kNasty, false, {}}});
  EXPECT_THAT(text, AllOf(Not(HasSubstr("\x1b")), Not(HasSubstr("\xff"))));
}

TEST(AnswerJson, HasItAll) {
  const auto json = nlohmann::json::parse(answer_json(sample(), {{"crash<=0", true, 0}}));
  EXPECT_EQ(json["campaign"]["tolerant_time_s"], 0.2);
  EXPECT_EQ(json["all"]["outcomes"]["silently_wrong"], 1);
  EXPECT_EQ(json["all"]["coverage"]["dangerous"], 3);
  EXPECT_NEAR(json["all"]["coverage"]["interval"][0].get<double>(), 0.0943, 5e-5);
  EXPECT_EQ(json["kinds"][0]["latency"]["first"]["worst_s"], 0.03);
  EXPECT_EQ(json["space"]["holes"], 8);
  EXPECT_EQ(json["space"]["met"][0], nlohmann::json({0, 2, 0, 4, 1}));
  EXPECT_EQ(json["required"][0]["holds"], true);
  EXPECT_EQ(json["required"][0]["missing"], 0);
  EXPECT_EQ(json["smallest"][0]["svg"], "<svg/>");
  EXPECT_EQ(json["case_command"], "lk-emu campaign every_fault.toml --case ");
  const auto& residual = json["residual"];
  ASSERT_EQ(residual["rows"].size(), 1);
  std::map<std::string, nlohmann::json> row;
  for (std::size_t n = 0; n < residual["columns"].size(); ++n) {
    row[residual["columns"][n]] = residual["rows"][0][n];
  }
  EXPECT_EQ(row["number"], 4);
  EXPECT_EQ(row["kind"], "jam");
  EXPECT_EQ(row["outcome"], "silently_wrong");
  EXPECT_EQ(row["violated_s"], 2.1);
  EXPECT_EQ(row["margin"], -0.25);
  EXPECT_EQ(row["drive_s"], nullptr);
  EXPECT_EQ(row["values"], nlohmann::json({"jam", 0.1}));
  EXPECT_FALSE(json.contains("comparison"));
}

TEST(AnswerJson, OtherSamplingsHaveNoInterval) {
  const auto json = nlohmann::json::parse(answer_json(sample(Sampling::kFull), {}));
  EXPECT_EQ(json["all"]["coverage"]["interval"], nullptr);
  EXPECT_EQ(json["all"]["coverage"]["share"], 2.0 / 3);
}

TEST(AnswerJson, ComparesToo) {
  const Comparison comparison =
      compare_campaigns(planted_head(), source_of({planted_case(0, "jam", CaseOutcome::kLate)}),
                        planted_head(), source_of({planted_case(0, "jam", CaseOutcome::kCrash)}));
  const auto alone = nlohmann::json::parse(comparison_json(comparison));
  EXPECT_EQ(alone["worse"], 1);
  EXPECT_EQ(alone["moves"][5][8], 1);
  EXPECT_EQ(alone["cases"][0]["before"], "late");
  const auto json = nlohmann::json::parse(answer_json(sample(), {}, &comparison));
  EXPECT_EQ(json["comparison"]["cases"][0]["case"][0], 0);
}

TEST(AnswerJUnit, HasATestForEachKind) {
  const std::string xml = answer_junit(sample());
  EXPECT_THAT(xml, HasSubstr("tests=\"3\" failures=\"1\" errors=\"1\" skipped=\"1\""));
  EXPECT_THAT(xml, HasSubstr("<testcase name=\"fault jam\" classname=\"every_fault\">\n"
                             "      <failure message=\"of 4 cases, 1 silently wrong, 1 detected by "
                             "the host, 1 detected by the drive, 1 tolerated\">case 4: jam"));
  EXPECT_THAT(xml, HasSubstr("lk-emu campaign every_fault.toml --case 4&#10;"));
  EXPECT_THAT(xml, HasSubstr("<error message=\"in none of 1 cases did it take effect\"/>"));
  EXPECT_THAT(xml, HasSubstr("<skipped message=\"no case has it\"/>"));
  EXPECT_THAT(answer_junit(answer_of(planted_head(),
                                     stream_of({planted_case(0, "dip", CaseOutcome::kTolerated)}))),
              HasSubstr("<testcase name=\"fault dip\" classname=\"every_fault\"/>"));
}

TEST(AnswerJUnit, IsXmlWhateverItSays) {
  const std::string xml = answer_junit(nasty_sample());
  EXPECT_THAT(xml,
              AllOf(Not(HasSubstr("<script")), Not(HasSubstr("\x1b")), Not(HasSubstr("\xff"))));
}

std::size_t count_of(const std::string& text, const std::string& word) {
  std::size_t count = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    ++count;
  }
  return count;
}

TEST(AnswerPage, NoTextIsMoreThanText) {
  const std::string page = answer_page(nasty_sample(), {{kNasty, false, {}}});
  EXPECT_EQ(count_of(page, "<script"), 2);  // data and scripts
  EXPECT_EQ(count_of(page, "</script"), 2);
  EXPECT_EQ(count_of(page, "<title>"), 1);
  EXPECT_THAT(page, AllOf(Not(HasSubstr("{{")), HasSubstr("&lt;/script&gt;")));
}

TEST(AnswerPage, NeedsNothingElse) {
  const std::string page = answer_page(sample(), {});
  EXPECT_THAT(page, HasSubstr("default-src 'none'"));
  for (const char* const outside :
       {"src=\"", "<link rel=\"stylesheet", "@import", "url(", "fetch("}) {
    EXPECT_THAT(page, Not(HasSubstr(outside))) << outside;
  }
}

}  // namespace
}  // namespace lk::emulator
