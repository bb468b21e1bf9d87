#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/core/sim_time.hpp"
#include "emulator/files/durable_file.hpp"
#include "emulator/record/mcap_records.hpp"

namespace lk::emulator::mcap {

/// An MCAP file that is being written: attachments, then messages in chunks with an index.
///
/// What was flushed is there after a kill. A chunk grows where it stands: messages are appended,
/// then its head is told of them. Between the two they are messages behind a chunk, which every
/// reader takes as well.
class File {
 public:
  /// `file` is empty, and not opened to append.
  explicit File(Descriptor file, std::string_view library);

  /// Before the first message. Schemas are JSON schemas, messages JSON.
  void attach(std::string_view name, std::string_view media_type, std::string_view data);
  std::uint16_t add_schema(std::string_view name, std::string_view json_schema);
  std::uint16_t add_channel(std::uint16_t schema, std::string_view topic);

  void message(std::uint16_t channel, SimTime at, std::string_view data);
  /// Gives the system all there is. Returns 0 or errno; after an error nothing is written any more.
  int flush();
  /// Flushes and writes what ends the file, its summary among it.
  int finish();

 private:
  struct Attached {
    std::uint64_t offset, length, size;
    std::string name, media_type;
  };

  void put(std::string_view bytes) { pending_ += bytes; }
  std::uint64_t end() const { return written_ + pending_.size(); }
  void close_chunk();
  std::string statistics() const;
  void write_at(std::uint64_t offset, std::string_view bytes);

  Descriptor file_;
  int error_ = 0;
  std::uint64_t written_ = 0;
  std::string pending_;  // to follow

  std::vector<std::string> schemas_;   // their records
  std::vector<std::string> channels_;  // their records
  std::vector<Attached> attached_;
  std::vector<Chunk> chunks_;                      // closed
  std::map<std::uint16_t, std::uint64_t> counts_;  // of messages, by channel

  bool open_ = false;  // there is a chunk that grows
  Chunk chunk_;
  std::map<std::uint16_t, MessageTimes> times_;  // of its messages, by channel
};

}  // namespace lk::emulator::mcap
