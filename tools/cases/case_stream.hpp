#pragma once

/// @file Cases from a file or standard input, results on standard output
/// (docs/reference/formats.md).

#include <string>

namespace lk::emulator {

struct CaseInput {
  std::string file = {};      // "-": standard input
  int jobs = 1;               // threads
  bool check = false;         // build the cases and run none
  std::string scenario = {};  // write the only case as this scenario file; run none
};

/// Returns whether all cases were possible. Throws StartError: unusable input.
bool run_cases(const CaseInput& options);

}  // namespace lk::emulator
