#pragma once

#include <string>

namespace lk::host {

/// The answer to one request.
struct Answer {
  int status = 0;  // of HTTP; 0: there was none
  std::string body;

  /// The first number behind this key; throws std::runtime_error when there is none.
  double number(const std::string& key) const;
  /// The sum of all numbers behind this key.
  double sum(const std::string& key) const;
};

/// Asks at the Unix socket `path`: "GET /clock", or "POST /directives" with a body.
Answer ask(const std::string& path, const std::string& request, const std::string& body = "");

}  // namespace lk::host
