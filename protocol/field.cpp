#include "protocol/field.hpp"

namespace lk::protocol {

std::int64_t raw(const Field& field, const Payload& data) {
  const int bits = 8 * bytes_of(field.wire);
  std::uint64_t number = 0;
  for (int k = bytes_of(field.wire); k-- > 0;) {
    number = number << 8U | data[static_cast<std::size_t>(field.byte + k)];
  }
  const bool negative = is_signed(field.wire) && (number >> (bits - 1) & 1U) != 0;
  return static_cast<std::int64_t>(negative ? number | ~std::uint64_t{0} << bits : number);
}

void put(const Field& field, std::int64_t raw, Payload& data) {
  for (int k = 0; k < bytes_of(field.wire); ++k) {
    data[static_cast<std::size_t>(field.byte + k)] =
        static_cast<std::uint8_t>(static_cast<std::uint64_t>(raw) >> (8 * k));
  }
}

double quantity(const Field& field, std::int64_t raw, const WireFormat& format) {
  const auto number = static_cast<double>(raw);
  switch (field.scale) {
    case Scale::kHundredth:
      return number / 100;
    case Scale::kThousandth:
      return number / 1000;
    case Scale::kFlag:
      return raw != 0 ? 1 : 0;
    case Scale::kBridge:
      return raw != kBridgeOff ? 1 : 0;
    case Scale::kOne:
    case Scale::kCenti:
    case Scale::kIqCommand:
    case Scale::kIqReply:
    case Scale::kPhaseCurrent:
    case Scale::kVoltage:
      return number * lsb(field.scale, format);
  }
  return number;
}

std::int64_t raw_of(const Field& field, double quantity, const WireFormat& format) {
  const RawRange range = width(field.wire);
  switch (field.scale) {
    case Scale::kHundredth:
      return quantize<std::int64_t>(quantity * 100, 1, range.min, range.max);
    case Scale::kThousandth:
      return quantize<std::int64_t>(quantity * 1000, 1, range.min, range.max);
    case Scale::kFlag:
      return quantity != 0 ? 1 : 0;
    case Scale::kBridge:
      return quantity != 0 ? 0 : kBridgeOff;
    case Scale::kOne:
    case Scale::kCenti:
    case Scale::kIqCommand:
    case Scale::kIqReply:
    case Scale::kPhaseCurrent:
    case Scale::kVoltage:
      return quantize<std::int64_t>(quantity, lsb(field.scale, format), range.min, range.max);
  }
  return 0;
}

}  // namespace lk::protocol
