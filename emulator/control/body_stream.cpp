#include "emulator/control/body_stream.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "emulator/control/body_json.hpp"
#include "emulator/control/stream_client.hpp"

namespace lk::emulator {
namespace {

constexpr auto kPeriod = std::chrono::microseconds(16'667);

class BodyStream : public StreamClient {
 public:
  BodyStream(HttpStream stream, std::shared_ptr<HttpShared> shared,
             std::shared_ptr<Entrance> entrance)
      : StreamClient(std::move(stream), std::move(shared), std::move(entrance)) {
    ++this->shared().body_streams;
  }
  BodyStream(const BodyStream&) = delete;
  BodyStream& operator=(const BodyStream&) = delete;
  ~BodyStream() override { --shared().body_streams; }

 private:
  void begin() override {
    due_ = monotonic_now();
    tell();
  }

  /// Scheduled by the period, not by the last message. Sends only if time has advanced.
  void tell() {
    const World& world = shared().api.world();
    if (!writing_ && told_at_ != world.time()) {
      told_at_ = world.time();
      text_ = body_now_text(world);
      writing_ = true;
      write(text_);
    }
    const MonoTime now = monotonic_now();
    due_ = std::max(due_ + kPeriod, now);
    do_after(due_ - now, [this] { tell(); });
  }

  void on_written() override { writing_ = false; }
  void end() override {}

  std::string text_;  // being sent
  std::optional<SimTime> told_at_;
  MonoTime due_{0};
  bool writing_ = false;
};

}  // namespace

void stream_body(HttpStream stream, HttpUpgrade upgrade, std::shared_ptr<HttpShared> shared,
                 std::shared_ptr<Entrance> entrance) {
  std::make_shared<BodyStream>(std::move(stream), std::move(shared), std::move(entrance))
      ->start(std::move(upgrade));
}

}  // namespace lk::emulator
