#include "protocol/field_values.hpp"

namespace lk::protocol {
namespace {

/// Returns the divisor of kHundredth and kThousandth; 0 for scales that multiply by an LSB.
double parts(Scale scale) {
  return scale == Scale::kHundredth ? 100 : scale == Scale::kThousandth ? 1000 : 0;
}

}  // namespace

std::int64_t raw(const Field& field, const Payload& data) {
  // Shifts the field up to the highest bits, then down again with or without sign extension.
  const int unused = 64 - 8 * bytes_of(field.wire);
  const std::uint64_t top = get_le<std::uint64_t>(data, field.byte) << unused;
  return is_signed(field.wire) ? static_cast<std::int64_t>(top) >> unused
                               : static_cast<std::int64_t>(top >> unused);
}

void put(const Field& field, std::int64_t raw, Payload& data) {
  for (int k = 0; k < bytes_of(field.wire); ++k) {
    data[static_cast<std::size_t>(field.byte + k)] =
        static_cast<std::uint8_t>(static_cast<std::uint64_t>(raw) >> (8 * k));
  }
}

double quantity(const Field& field, std::int64_t raw, const WireFormat& format) {
  if (field.scale == Scale::kFlag) return raw != 0 ? 1 : 0;
  if (field.scale == Scale::kBridge) return raw != kBridgeOff ? 1 : 0;
  const auto number = static_cast<double>(raw);
  const double shares = parts(field.scale);
  return shares > 0 ? number / shares : number * lsb(field.scale, format);
}

std::int64_t raw_of(const Field& field, double quantity, const WireFormat& format) {
  const RawRange range = width(field.wire);
  const double shares = parts(field.scale);
  return shares > 0
             ? quantize<std::int64_t>(quantity * shares, 1, range.min, range.max)
             : quantize<std::int64_t>(quantity, lsb(field.scale, format), range.min, range.max);
}

}  // namespace lk::protocol
