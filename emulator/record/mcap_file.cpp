#include "emulator/record/mcap_file.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

namespace lk::emulator::mcap {
namespace {

/// Records of a chunk, after which another one begins: what a reader takes at once.
constexpr std::uint64_t kFullChunk = std::uint64_t{1} << 20U;

}  // namespace

File::File(Descriptor file, std::string_view library) : file_(std::move(file)) {
  put(kMagic);
  put(record(Op::kHeader, Content().text("").text(library).bytes()));
}

void File::attach(std::string_view name, std::string_view media_type, std::string_view data) {
  Content content;
  content.number(std::uint64_t{0}).number(std::uint64_t{0}).text(name).text(media_type);
  content.number(std::uint64_t{data.size()}).raw(data);
  content.number(crc32(content.bytes()));
  const std::string bytes = record(Op::kAttachment, content.bytes());
  attached_.push_back(
      {end(), bytes.size(), data.size(), std::string(name), std::string(media_type)});
  put(bytes);
}

std::uint16_t File::add_schema(std::string_view name, std::string_view json_schema) {
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  put(schemas_.emplace_back(schema(id, name, json_schema)));
  return id;
}

std::uint16_t File::add_channel(std::uint16_t schema, std::string_view topic) {
  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);
  put(channels_.emplace_back(channel(id, schema, topic)));
  return id;
}

void File::message(std::uint16_t channel, SimTime at, std::string_view data) {
  const auto at_ns = static_cast<std::uint64_t>(std::max<std::int64_t>(0, at.count()));
  if (!open_) {
    open_ = true;
    chunk_.start_ns = chunk_.end_ns = at_ns;
    chunk_.offset = end();
    put(chunk_head(chunk_));
  }
  const std::uint64_t number = counts_[channel]++;
  const std::string bytes = mcap::message(channel, static_cast<std::uint32_t>(number), at_ns, data);
  times_[channel].emplace_back(at_ns, chunk_.size);
  chunk_.start_ns = std::min(chunk_.start_ns, at_ns);
  chunk_.end_ns = std::max(chunk_.end_ns, at_ns);
  chunk_.size += bytes.size();
  chunk_.crc = crc32(bytes, chunk_.crc);
  put(bytes);
  if (chunk_.size >= kFullChunk) close_chunk();
}

int File::flush() {
  if (pending_.empty()) return error_;
  write_at(written_, pending_);
  written_ += pending_.size();
  pending_.clear();
  if (open_) write_at(chunk_.offset, chunk_head(chunk_));
  return error_;
}

void File::close_chunk() {
  if (!open_) return;
  flush();
  open_ = false;
  const std::uint64_t begin = end();
  for (const auto& [channel, times] : times_) {
    chunk_.index_offsets[channel] = end();
    put(message_index(channel, times));
  }
  chunk_.index_length = end() - begin;
  chunks_.push_back(std::exchange(chunk_, {}));
  times_.clear();
}

std::string File::statistics() const {
  std::uint64_t all = 0;
  Content counts;
  for (const auto& [channel, count] : counts_) {
    counts.number(channel).number(count);
    all += count;
  }
  std::uint64_t start_ns = chunks_.empty() ? 0 : chunks_.front().start_ns;
  std::uint64_t end_ns = 0;
  for (const Chunk& chunk : chunks_) {
    start_ns = std::min(start_ns, chunk.start_ns);
    end_ns = std::max(end_ns, chunk.end_ns);
  }
  const auto count = [](const auto& list) { return static_cast<std::uint32_t>(list.size()); };
  Content content;
  content.number(all).number(static_cast<std::uint16_t>(schemas_.size()));
  content.number(count(channels_)).number(count(attached_)).number(std::uint32_t{0});
  content.number(count(chunks_)).number(start_ns).number(end_ns).text(counts.bytes());
  return record(Op::kStatistics, content.bytes());
}

int File::finish() {
  close_chunk();
  put(record(Op::kDataEnd,
             Content().number(std::uint32_t{0}).bytes()));  // heads were written twice
  const std::uint64_t summary = end();
  std::string bytes;
  std::string offsets;
  const auto group = [&](Op op, const std::string& records) {
    if (records.empty()) return;
    Content content;
    content.number(static_cast<std::uint8_t>(op)).number(summary + bytes.size());
    offsets += record(Op::kSummaryOffset, content.number(std::uint64_t{records.size()}).bytes());
    bytes += records;
  };
  const auto joined = [](const std::vector<std::string>& records) {
    std::string all;
    for (const std::string& one : records) all += one;
    return all;
  };
  group(Op::kSchema, joined(schemas_));
  group(Op::kChannel, joined(channels_));
  std::string indexes;
  for (const Chunk& chunk : chunks_) indexes += chunk_index(chunk);
  group(Op::kChunkIndex, indexes);
  indexes.clear();
  for (const Attached& one : attached_) {
    Content content;
    content.number(one.offset).number(one.length).number(std::uint64_t{0}).number(std::uint64_t{0});
    content.number(one.size).text(one.name).text(one.media_type);
    indexes += record(Op::kAttachmentIndex, content.bytes());
  }
  group(Op::kAttachmentIndex, indexes);
  group(Op::kStatistics, statistics());
  // The sum is of all up to where it stands itself.
  const std::uint64_t summary_offsets = summary + bytes.size();
  Content footer;
  footer.number(summary).number(summary_offsets);
  std::string ending = record(Op::kFooter, footer.bytes() + std::string(4, '\0'));
  ending.resize(ending.size() - 4);
  bytes += offsets + ending;
  put(bytes);
  put(Content().number(crc32(bytes)).bytes());
  put(kMagic);
  return flush();
}

void File::write_at(std::uint64_t offset, std::string_view bytes) {
  while (error_ == 0 && !bytes.empty()) {
    const ssize_t count =
        ::pwrite(file_.get(), bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (count < 0) {
      if (errno != EINTR) error_ = errno;
      continue;
    }
    bytes.remove_prefix(static_cast<std::size_t>(count));
    offset += static_cast<std::uint64_t>(count);
  }
}

}  // namespace lk::emulator::mcap
