#pragma once

#include <string>

namespace lk::host {

/// Answer to a request.
struct Answer {
  int status = 0;  // HTTP status; 0: no answer
  std::string body;

  /// Returns the first number with this key; throws std::runtime_error if there is none.
  double number(const std::string& key) const;
  /// Returns the sum of all numbers with this key.
  double sum(const std::string& key) const;
};

/// Sends a request to the Unix socket `path`: "GET /clock", or "POST /directives" with a body.
Answer ask(const std::string& path, const std::string& request, const std::string& body = "");

}  // namespace lk::host
