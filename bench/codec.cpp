// The codec: frames per second in each direction, and the length of a frame in bits.
#include "protocol/codec.hpp"

#include <benchmark/benchmark.h>

#include <cstddef>
#include <vector>

#include "protocol/frame_bits.hpp"

namespace lk::protocol {
namespace {

/// One query of each kind that `legacy` knows.
std::vector<Frame> queries() {
  std::vector<Frame> frames;
  for (const auto& row : commands()) {
    if (!answers(kLegacyFormat, row.opcode)) {
      continue;
    }
    Frame frame;
    frame.id = kSingleDriveId + 1;
    frame.data = {static_cast<std::uint8_t>(row.opcode), 0, 0x34, 0x12, 0x78, 0x56, 0x01, 0};
    frames.push_back(frame);
  }
  return frames;
}

void BM_DecodeQuery(benchmark::State& state) {
  const auto frames = queries();
  std::size_t k = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(decode_query(frames[k], kLegacyFormat));
    k = (k + 1) % frames.size();
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_DecodeQuery);

void BM_EncodeReply(benchmark::State& state) {
  const Reply reply = State2{ReadState2::kOpcode, 35, 1.6, -500, 0x1234};
  for (auto _ : state) {
    benchmark::DoNotOptimize(encode_reply(1, reply, kLegacyFormat));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_EncodeReply);

void BM_EncodeQuery(benchmark::State& state) {
  const Command command = Position2{500, 36000};
  for (auto _ : state) {
    benchmark::DoNotOptimize(encode_query(1, command, kLegacyFormat));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_EncodeQuery);

void BM_DecodeReply(benchmark::State& state) {
  const Frame frame =
      encode_reply(1, State2{ReadState2::kOpcode, 35, 1.6, -500, 0x1234}, kLegacyFormat);
  for (auto _ : state) {
    benchmark::DoNotOptimize(decode_reply(frame, kLegacyFormat));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_DecodeReply);

void BM_FrameBits(benchmark::State& state) {
  const auto frames = queries();
  std::size_t k = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(frame_bits(frames[k]));
    k = (k + 1) % frames.size();
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_FrameBits);

}  // namespace
}  // namespace lk::protocol
