#include "emulator/record/mcap_records.hpp"

#include <array>

namespace lk::emulator::mcap {
namespace {

constexpr std::array<std::uint32_t, 256> crc_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t byte = 0; byte < table.size(); ++byte) {
    std::uint32_t value = byte;
    for (int bit = 0; bit < 8; ++bit) {
      value = (value & 1U) != 0 ? 0xEDB88320U ^ (value >> 1U) : value >> 1U;
    }
    table[byte] = value;
  }
  return table;
}

constexpr auto kCrc = crc_table();

/// Op code and length of a record.
std::string head(Op op, std::uint64_t length) {
  return Content().number(static_cast<std::uint8_t>(op)).number(length).bytes();
}

}  // namespace

std::uint32_t crc32(std::string_view bytes, std::uint32_t before) {
  std::uint32_t value = ~before;
  for (const char c : bytes) {
    value = kCrc[(value ^ static_cast<std::uint8_t>(c)) & 0xFFU] ^ (value >> 8U);
  }
  return ~value;
}

Content& Content::text(std::string_view value) {
  number(static_cast<std::uint32_t>(value.size()));
  return raw(value);
}

Content& Content::raw(std::string_view value) {
  bytes_ += value;
  return *this;
}

std::string record(Op op, const std::string& content) { return head(op, content.size()) + content; }

std::string chunk_head(const Chunk& chunk) {
  Content content;
  content.number(chunk.start_ns).number(chunk.end_ns).number(chunk.size).number(chunk.crc);
  content.text("").number(chunk.size);  // not compressed
  return head(Op::kChunk, content.bytes().size() + chunk.size) + content.bytes();
}

std::string chunk_index(const Chunk& chunk) {
  Content offsets;
  for (const auto& [channel, offset] : chunk.index_offsets) offsets.number(channel).number(offset);
  Content content;
  content.number(chunk.start_ns).number(chunk.end_ns).number(chunk.offset);
  content.number(kChunkHead + chunk.size).text(offsets.bytes()).number(chunk.index_length);
  content.text("").number(chunk.size).number(chunk.size);
  return record(Op::kChunkIndex, content.bytes());
}

std::string message(std::uint16_t channel, std::uint32_t sequence, std::uint64_t at_ns,
                    std::string_view data) {
  Content content;
  content.number(channel).number(sequence).number(at_ns).number(at_ns).raw(data);
  return record(Op::kMessage, content.bytes());
}

std::string message_index(std::uint16_t channel, const MessageTimes& times) {
  Content entries;
  for (const auto& [at_ns, offset] : times) entries.number(at_ns).number(offset);
  return record(Op::kMessageIndex, Content().number(channel).text(entries.bytes()).bytes());
}

std::string schema(std::uint16_t id, std::string_view name, std::string_view json_schema) {
  return record(Op::kSchema,
                Content().number(id).text(name).text("jsonschema").text(json_schema).bytes());
}

std::string channel(std::uint16_t id, std::uint16_t schema, std::string_view topic) {
  return record(Op::kChannel,
                Content().number(id).number(schema).text(topic).text("json").text("").bytes());
}

}  // namespace lk::emulator::mcap
