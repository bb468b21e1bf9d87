#pragma once

/// @file What `lk-emu campaign` does, once its words are understood. Throw StartError, ConfigError;
/// return the exit status.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tools/campaign/plan/plan.hpp"
#include "tools/campaign/run/campaign_run.hpp"

namespace lk::emulator {

/// What is written of one case; empty: nothing.
struct CaseOutputs {
  std::string csv, candump, scenario;
  std::vector<std::string> set;  // "fault.for_s=0.1": otherwise than the case has it
  std::vector<std::string> signals;
  double rate_Hz = 100;
};

/// What is told of all of them.
struct CampaignReports {
  std::string html, json, junit;
  std::vector<std::string> require;
};

struct CampaignRequest {
  std::filesystem::path store;
  bool resume = false;
  std::string resuming;  // the command line that goes on, once it is interrupted
  CampaignOptions options;
  std::string after;  // of a generation that is a shard: results of those before; empty: none
  bool quiet = false;
  CampaignReports reports;
};

/// `store` has the values of the cases of `adaptive`.
int show_case(const Plan& plan, std::uint64_t number, const std::filesystem::path& store,
              const CaseOutputs& outputs);
/// Says how many cases there are, what each dimension gives, and how long they take with `jobs`.
int tell_cost(const Plan& plan, int jobs);
int run_and_report(const Plan& plan, const CampaignRequest& request);
int report_results(const std::filesystem::path& store, const CampaignReports& reports, bool quiet);
int compare_results(const std::filesystem::path& before, const std::filesystem::path& now,
                    const CampaignReports& reports);

}  // namespace lk::emulator
