#pragma once

namespace lk::emulator {

/// Visitor for std::visit with one function for each alternative; a missing one does not compile.
template <class... Functions>
struct overloaded : Functions... {
  using Functions::operator()...;
};
template <class... Functions>
overloaded(Functions...) -> overloaded<Functions...>;

}  // namespace lk::emulator
