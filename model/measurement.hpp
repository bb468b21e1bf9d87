#pragma once

namespace lk::model {

/// The only data that the firmware gets from the plant in the fast tick.
template <class T>
struct Measurement {
  T encoder_counts{};  // unwrapped, 2^EncoderParams::bits per turn
  T i_a{}, i_b{};      // A; the drive computes i_c = −i_a − i_b
};

}  // namespace lk::model
