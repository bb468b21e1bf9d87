#pragma once

/// @file Reads cases from a file or standard input, and writes results to standard output
/// (docs/reference/formats.md).

#include <string>

namespace lk::emulator {

struct CaseInput {
  std::string file = {};      // "-": standard input
  int jobs = 1;               // threads
  bool check = false;         // true: build the cases but run none
  std::string scenario = {};  // not empty: write the only case to this scenario file, run nothing
};

/// Runs the cases. Returns true if all were possible. Throws StartError if the input is unusable.
bool run_cases(const CaseInput& options);

}  // namespace lk::emulator
