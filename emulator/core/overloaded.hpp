#pragma once

namespace lk::emulator {

/// A function for each alternative of a variant, for std::visit: one that is missing does not
/// compile.
template <class... Functions>
struct overloaded : Functions... {
  using Functions::operator()...;
};
template <class... Functions>
overloaded(Functions...) -> overloaded<Functions...>;

}  // namespace lk::emulator
