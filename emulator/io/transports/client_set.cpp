#include "emulator/io/transports/client_set.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <cerrno>
#include <utility>

#include "emulator/core/start_error.hpp"
#include "emulator/io/transports/socketcand.hpp"
#include "emulator/io/transports/terminal.hpp"

namespace lk::emulator {
namespace {

/// Limit for unacknowledged replies. During that time the kernel sends no keep-alive probes, and by
/// default it repeats a reply for about 15 min. Equals the limit for an idle connection below.
constexpr int kAcknowledgeTimeout_ms = 60'000;

}  // namespace

void keep_connections_alive(int listening_socket) {
  // Assumed: a person who restarts a host waits no longer than a minute.
  constexpr struct {
    int level, option, value;
  } kSettings[] = {{SOL_SOCKET, SO_KEEPALIVE, 1},
                   {IPPROTO_TCP, TCP_KEEPIDLE, 30},   // seconds of silence before the first probe
                   {IPPROTO_TCP, TCP_KEEPINTVL, 10},  // seconds between probes
                   {IPPROTO_TCP, TCP_KEEPCNT, 3},     // probes without an answer
                   {IPPROTO_TCP, TCP_USER_TIMEOUT, kAcknowledgeTimeout_ms}};
  for (const auto& [level, option, value] : kSettings) {
    ::setsockopt(listening_socket, level, option, &value, sizeof value);
  }
}

namespace {

/// Limits for the bytes of one read, from one client and from all together. No client delays the
/// others, and many clients delay the loop no longer than two.
constexpr std::size_t kClientBytes = 4096;
constexpr std::size_t kBytesOfAll = 2 * kClientBytes;
constexpr std::size_t kMaxEvents = 64;
// Tags of epoll events; values between these two are numbers of clients.
constexpr std::uint64_t kWatched = 0;
constexpr std::uint64_t kTimer = UINT64_MAX;

/// Acknowledges received bytes at once: otherwise the client's kernel may hold back its next bytes
/// (RFC 896). Bytes held back on this machine arrive before this function returns.
void acknowledge(const Descriptor& socket) {
  const int now = 1;
  if (socket) ::setsockopt(socket.get(), IPPROTO_TCP, TCP_QUICKACK, &now, sizeof now);
}

}  // namespace

ClientSet::ClientSet(std::string name)
    : name_(std::move(name)),
      epoll_(::epoll_create1(EPOLL_CLOEXEC)),
      timer_(::timerfd_create(CLOCK_REALTIME, TFD_NONBLOCK | TFD_CLOEXEC)),
      bytes_(kClientBytes) {
  epoll_event event{.events = EPOLLIN, .data = {.u64 = kTimer}};
  if (!epoll_ || !timer_ || ::epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, timer_.get(), &event) != 0) {
    throw StartError(name_ + ": " + errno_text(errno));
  }
}

void ClientSet::watch(int fd) {
  epoll_event event{.events = EPOLLIN, .data = {.u64 = kWatched}};
  ::epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, fd, &event);  // EEXIST: already watched
}

void ClientSet::ignore(int fd) { ::epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, fd, nullptr); }

void ClientSet::add(Descriptor fd, std::string peer, std::unique_ptr<ClientProtocol> protocol) {
  Client client;
  client.fd = fd.get();
  client.own = std::move(fd);
  client.peer = std::move(peer);
  client.protocol = std::move(protocol);
  add(std::move(client));
}

void ClientSet::add_lent(int fd, std::string peer, std::unique_ptr<ClientProtocol> protocol) {
  Client client;
  client.fd = fd;
  client.peer = std::move(peer);
  client.protocol = std::move(protocol);
  add(std::move(client));
}

void ClientSet::add(Client client) {
  client.number = ++last_number_;
  epoll_event event{.events = EPOLLIN, .data = {.u64 = client.number}};
  if (::epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, client.fd, &event) != 0) {
    spdlog::warn("{}: {}: {}", name_, client.peer, errno_text(errno));
    return;
  }
  spdlog::debug("{}: {} has come", name_, client.peer);
  client.unsent = client.protocol->greeting();
  Client& there = clients_.emplace(client.number, std::move(client)).first->second;
  if (!flush(there)) clients_.erase(there.number);
}

ClientSet::Collected ClientSet::collect(std::vector<ReceivedFrame>& out,
                                        std::chrono::milliseconds timeout) {
  std::array<epoll_event, kMaxEvents> events{};
  const int count =
      ::epoll_wait(epoll_.get(), events.data(), kMaxEvents, static_cast<int>(timeout.count()));
  Collected collected;
  collected.more = count == static_cast<int>(kMaxEvents);
  for (int n = 0; n < count; ++n) {
    const epoll_event& event = events[static_cast<std::size_t>(n)];
    collected.watched = collected.watched || event.data.u64 == kWatched;
    if (event.data.u64 == kTimer) on_timer(out);
    const auto found = clients_.find(static_cast<std::uint32_t>(event.data.u64));
    if (event.data.u64 > UINT32_MAX || found == clients_.end()) continue;
    Client& client = found->second;
    const bool speaks = client.own && (event.events & ~EPOLLOUT) != 0;  // terminals are read below
    const bool there = ((event.events & EPOLLOUT) == 0 || flush(client)) &&
                       (!speaks || read_from(client, out, collected.more));
    if (there) continue;
    spdlog::debug("{}: {} has left", name_, client.peer);
    clients_.erase(found);
  }
  // Reads terminals without an event: bytes that a host has written may still be in the kernel's
  // work queue. A read fetches them; epoll does not (n_tty_read).
  for (auto& [number, client] : clients_) {
    if (!client.own) read_from(client, out, collected.more);
  }
  arm_timer();
  return collected;
}

bool ClientSet::read_from(Client& client, std::vector<ReceivedFrame>& out, bool& more) {
  if (client.leaves_at) return false;  // its sending side is closed: this event is a reset
  const std::size_t share = std::min(kClientBytes, kBytesOfAll / clients_.size());
  const ssize_t size = ::read(client.fd, bytes_.data(), share);
  if (size < 0) return errno == EAGAIN || errno == EINTR;
  if (size == 0) {
    client.leaves_at = wall_now() + kLastReply;
    set_interest(client);
    return true;
  }
  more = more || static_cast<std::size_t>(size) == share;
  client.ack_pending = true;
  const auto now = wall_now();
  parsed_ = {};
  parsed_.room = room_;
  client.protocol->parse({bytes_.data(), static_cast<std::size_t>(size)}, now, parsed_);
  for (const protocol::Frame& frame : parsed_.frames) out.push_back({now, frame, client.number});
  room_ -= parsed_.frames.size();
  stats_.malformed += parsed_.malformed;
  const bool warns = !parsed_.warning.empty() && !std::exchange(client.warned, true);
  if (warns && log_limit_.may_log(name_)) {
    spdlog::warn("{}: {} {}", name_, client.peer, parsed_.warning);
  }
  put(client, parsed_.response, kMaxUnsent + kMaxAnswers);
  return true;
}

void ClientSet::on_timer(std::vector<ReceivedFrame>& out) {
  std::uint64_t times = 0;
  if (::read(timer_.get(), &times, sizeof times) < 0) return;  // the timer was set again meanwhile
  timer_at_.reset();
  for (auto& [number, client] : clients_) take_due(client, out);
  std::erase_if(clients_, [now = wall_now()](const auto& entry) {
    return entry.second.leaves_at && *entry.second.leaves_at <= now;
  });
}

void ClientSet::drop_finished() {
  std::erase_if(clients_, [](const auto& entry) { return entry.second.leaves_at.has_value(); });
}

void ClientSet::take_due(Client& client, std::vector<ReceivedFrame>& out) {
  const auto now = wall_now();
  parsed_.frames.clear();
  client.protocol->take_due(now, parsed_.frames);
  for (const protocol::Frame& frame : parsed_.frames) out.push_back({now, frame, client.number});
}

void ClientSet::arm_timer() {
  std::optional<ClientProtocol::Time> first;
  for (const auto& [number, client] : clients_) {
    for (const auto& due : {client.protocol->next_due(), client.leaves_at}) {
      if (due && (!first || *due < *first)) first = due;
    }
  }
  if (first == std::exchange(timer_at_, first)) return;
  itimerspec when{};
  if (first) {
    const auto seconds = std::chrono::floor<std::chrono::seconds>(*first);
    when.it_value = {.tv_sec = seconds.count(), .tv_nsec = (*first - seconds).count()};
  }
  ::timerfd_settime(timer_.get(), TFD_TIMER_ABSTIME, &when, nullptr);
}

void ClientSet::flush() {
  for (auto& [number, client] : clients_) {
    if (!client.unsent.empty() && !client.wants_write) flush(client);
    if (std::exchange(client.ack_pending, false)) acknowledge(client.own);
  }
}

void ClientSet::queue_frames(std::span<const protocol::Frame> frames, std::uint32_t except) {
  for (auto& [number, client] : clients_) {
    if (number != except) queue_frames(client, frames);
  }
}

void ClientSet::queue_frames(Client& client, std::span<const protocol::Frame> frames) {
  const auto now = wall_now();
  for (const protocol::Frame& frame : frames) {
    encoded_.clear();
    client.protocol->encode(frame, now, encoded_);
    put(client, encoded_, kMaxUnsent);
  }
}

/// Queues all of `bytes`, or none if more than `most` bytes would be unsent.
void ClientSet::put(Client& client, std::string_view bytes, std::size_t most) {
  if (bytes.empty()) return;
  // Ignores the result of `flush`: the next read detects a client that has gone.
  if (client.unsent.size() + bytes.size() > most && !client.wants_write) flush(client);
  if (client.unsent.size() + bytes.size() <= most) {
    client.unsent += bytes;
    return;
  }
  ++stats_.lost_unread;
  client.protocol->note_loss();
  if (!std::exchange(client.is_losing, true) && log_limit_.may_log(name_)) {
    spdlog::warn("{}: {} does not read: frames for it are lost", name_, client.peer);
  }
}

bool ClientSet::flush(Client& client) {
  std::string_view left = client.unsent;
  while (!left.empty()) {
    const ssize_t size = ::write(client.fd, left.data(), left.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0 && errno != EAGAIN) return false;
    if (size < 0) break;
    left.remove_prefix(static_cast<std::size_t>(size));
    client.ack_pending = false;  // TCP acknowledges together with these bytes
    if (client.leaves_at) client.leaves_at = wall_now() + kLastReply;
  }
  client.unsent.erase(0, client.unsent.size() - left.size());
  wait_for_room(client, !client.unsent.empty());
  const bool reads = client.unsent.empty() && std::exchange(client.is_losing, false);
  if (reads && log_limit_.may_log(name_)) {
    spdlog::info("{}: {} reads again", name_, client.peer);
  }
  return true;
}

void ClientSet::wait_for_room(Client& client, bool wants_write) {
  if (std::exchange(client.wants_write, wants_write) == wants_write) return;
  set_interest(client);
}

/// Sets the events that epoll reports for the client. It always reports a reset, too.
void ClientSet::set_interest(const Client& client) {
  std::uint32_t interest = 0;
  if (!client.leaves_at) interest |= EPOLLIN;
  if (client.wants_write) interest |= EPOLLOUT;
  epoll_event event{.events = interest, .data = {.u64 = client.number}};
  ::epoll_ctl(epoll_.get(), EPOLL_CTL_MOD, client.fd, &event);
}

namespace {

using boost::asio::ip::tcp;

/// Returns `path` with its last number increased by 1: "/dev/ttyACM0" gives "/dev/ttyACM1".
std::string next_path(const std::string& path) {
  const std::size_t digits = path.find_last_not_of("0123456789") + 1;
  const std::string number = path.substr(digits);
  const int next = number.empty() || number.size() > 6 ? 1 : std::stoi(number) + 1;
  return path.substr(0, number.size() > 6 ? path.size() : digits) + std::to_string(next);
}

class StreamPort final : public Port {
 public:
  StreamPort(boost::asio::io_context& loop, const std::string& name, const BusName& place,
             StreamSetup setup, std::function<void()> on_frames)
      : loop_(loop),
        name_(name),
        place_(place),
        setup_(std::move(setup)),
        clients_(name),
        acceptor_(loop),
        readiness_(loop, std::move(on_frames)) {
    open();
    if (const auto error = readiness_.watch(clients_.descriptor())) {
      throw StartError(name_ + ": " + error.message());
    }
  }

  bool is_up() const override { return pty_ || acceptor_.is_open(); }
  bool can_wait() const override { return !pty_; }  // a host's open would not end the wait
  void end_turn() override { clients_.flush(); }
  int descriptor() const override { return clients_.descriptor(); }
  /// Always 0, as time does not wait for clients: one that does not read loses frames.
  std::size_t pending() const override { return 0; }

  void set_room(std::size_t frames) override { clients_.set_room(frames); }

  void set_gone(bool gone, bool moves) override {
    if (std::exchange(gone_, gone) == gone) return;
    if (!gone) return reopen();
    if (moves && pty_) place_.path = next_path(place_.path);
    clients_.clear();
    pty_.reset();
    beacon_.reset();
    close_acceptor();
  }

  void check_link() override {
    if (!gone_ && !is_up()) reopen();
    if (acceptor_.is_open()) clients_.watch(acceptor_.native_handle());
    if (beacon_) beacon_->send_if_due();
  }

  void send(std::span<const protocol::Frame> frames) override {
    sent_ += frames.size();
    clients_.queue_frames(frames, 0);
  }

  void pass_on(const protocol::Frame& frame, std::uint32_t sender) override {
    clients_.queue_frames({&frame, 1}, sender);
  }

  PortStats stats() const override {
    PortStats stats = clients_.stats();
    stats.sent = sent_;
    stats.refused = refused_;
    return stats;
  }

 private:
  Batch next_batch(Wait wait) override {
    received_.clear();
    const ClientSet::Collected collected = clients_.collect(
        received_, std::chrono::ceil<std::chrono::milliseconds>(
                       wait == Wait::kForOne ? kReceiveTimeout : kReceiveTimeout.zero()));
    if (pty_) pty_->handle_host_events();
    if (collected.watched) accept_clients();  // the next batch reads their first bytes
    return {received_, collected.more || collected.watched, 0};
  }

  /// Throws StartError.
  void open() {
    if (place_.scheme->place == BusPlace::kPath) {
      pty_.emplace(loop_, name_, place_.path, true);
      clients_.add_lent(pty_->descriptor(), place_.path, setup_.make_protocol());
    } else {
      listen();
    }
  }

  /// Opens the port; if another program has taken its place, `check_link` tries again.
  void reopen() {
    try {
      open();
      place_taken_ = false;
    } catch (const StartError& problem) {
      close_acceptor();
      if (!std::exchange(place_taken_, true)) spdlog::warn("{}", problem.what());
    }
  }

  void close_acceptor() {
    boost::system::error_code ignored;
    acceptor_.close(ignored);
  }

  void listen() {
    boost::system::error_code error;
    const auto address = boost::asio::ip::make_address(place_.address, error);
    if (error) throw StartError(name_ + ": " + place_.address + " is not an IP address");
    const tcp::endpoint endpoint(address, place_.port);
    try {
      acceptor_.open(endpoint.protocol());
      acceptor_.set_option(tcp::acceptor::reuse_address(true));
      acceptor_.bind(endpoint);
      acceptor_.listen();
      acceptor_.non_blocking(true);
      keep_connections_alive(acceptor_.native_handle());
    } catch (const boost::system::system_error& problem) {
      throw StartError(name_ + ": cannot listen there: " + problem.code().message());
    }
    if (!address.is_loopback()) {
      spdlog::warn("{}: anyone who can reach {} can command these drives{}", name_, place_.address,
                   address.is_unspecified() ? ", which is all addresses of this machine" : "");
    }
    clients_.watch(acceptor_.native_handle());
    if (setup_.beacon && address.is_v4() && !address.is_unspecified()) {
      beacon_.emplace(loop_, address.to_v4(), place_.port);
    }
  }

  /// Accepts waiting clients, at most 64; the others wait for the next batch.
  void accept_clients() {
    constexpr int kMaxAtOnce = 64;
    for (int n = 0; n < kMaxAtOnce; ++n) {
      boost::system::error_code error;
      tcp::endpoint from;
      tcp::socket socket(acceptor_.get_executor());
      acceptor_.accept(socket, from, error);
      if (error == boost::asio::error::would_block) return;
      if (error) {  // for example, no descriptors left: accepts none until check_link
        clients_.ignore(acceptor_.native_handle());
        return;
      }
      if (clients_.size() >= setup_.most_clients) clients_.drop_finished();
      if (clients_.size() >= setup_.most_clients) {
        if (refused_++ == 0) {
          spdlog::warn("{}: {} clients, the limit: others are refused", name_, setup_.most_clients);
        }
        socket.write_some(boost::asio::buffer(setup_.refusal), error);
        continue;
      }
      socket.set_option(tcp::no_delay(true), error);
      socket.native_non_blocking(true, error);
      const std::string peer = from.address().to_string() + " port " + std::to_string(from.port());
      clients_.add(Descriptor(socket.release()), peer, setup_.make_protocol());
    }
  }

  boost::asio::io_context& loop_;
  std::string name_;
  BusName place_;
  bool gone_ = false;
  bool place_taken_ = false;  // at the last attempt to reopen
  StreamSetup setup_;
  std::optional<PtyLink> pty_;
  ClientSet clients_;
  tcp::acceptor acceptor_;
  Readiness readiness_;  // of `clients_`
  std::optional<Beacon> beacon_;
  std::uint64_t sent_ = 0;
  std::uint64_t refused_ = 0;
  std::vector<ReceivedFrame> received_;
};

}  // namespace

std::unique_ptr<Port> make_stream_port(boost::asio::io_context& loop, const std::string& name,
                                       const BusName& place, StreamSetup setup,
                                       std::function<void()> on_frames) {
  return std::make_unique<StreamPort>(loop, name, place, std::move(setup), std::move(on_frames));
}

}  // namespace lk::emulator
