#pragma once

namespace lk::model {

/// The only thing that crosses from the plant to the firmware in the fast tick.
template <class T>
struct Measurement {
  T encoder_counts{};  // unwrapped, native bits of the encoder
  T i_a{}, i_b{};      // A; the drive takes i_c = −i_a − i_b
};

}  // namespace lk::model
