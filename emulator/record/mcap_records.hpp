#pragma once

/// @file Records of MCAP files, as bytes: https://mcap.dev/spec, version 0. Times are nanoseconds.

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace lk::emulator::mcap {

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

enum class Op : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

/// CRC-32 as zlib has it; `before` is that of what comes before `bytes`.
std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0);

/// Content of a record, put together field by field, little-endian.
class Content {
 public:
  template <typename Integer>
  Content& number(Integer value) {
    for (std::size_t n = 0; n < sizeof value; ++n) {
      bytes_ += static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * n) & 0xFFU);
    }
    return *this;
  }
  /// With its length before it, of 32 bits.
  Content& text(std::string_view value);
  /// With no length before it.
  Content& raw(std::string_view value);
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// Op code, length, content.
std::string record(Op op, const std::string& content);

/// Offsets of messages in their chunk, by when they were logged.
using MessageTimes = std::vector<std::pair<std::uint64_t, std::uint64_t>>;

/// What is known of a chunk: it stands in the file before its records and, again, in the index.
struct Chunk {
  std::uint64_t start_ns = 0;  // of the earliest of its messages
  std::uint64_t end_ns = 0;
  std::uint64_t offset = 0;                              // in the file
  std::uint64_t size = 0;                                // of its records
  std::uint32_t crc = 0;                                 // of them
  std::map<std::uint16_t, std::uint64_t> index_offsets;  // by channel
  std::uint64_t index_length = 0;
};

/// A chunk record as far as its records, which follow.
std::string chunk_head(const Chunk& chunk);
inline constexpr std::size_t kChunkHead = 49;  // bytes of it

std::string chunk_index(const Chunk& chunk);
std::string message(std::uint16_t channel, std::uint32_t sequence, std::uint64_t at_ns,
                    std::string_view data);
std::string message_index(std::uint16_t channel, const MessageTimes& times);
std::string schema(std::uint16_t id, std::string_view name, std::string_view json_schema);
std::string channel(std::uint16_t id, std::uint16_t schema, std::string_view topic);

}  // namespace lk::emulator::mcap
