#include "drivers/modbus/tcp_server.h"

#include <fcntl.h>
#include <pthread.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <span>
#include <system_error>
#include <utility>

#include "drivers/modbus/errno_text.h"
#include "drivers/modbus/pdu.h"

namespace plumbline::modbus {
namespace {

constexpr std::int64_t kClientTimeout_ns = 1'000'000'000;  // to complete a frame, to send responses

}  // namespace

void TcpConnection::Open(os::Descriptor socket, const IpAddress& address, std::int64_t now_ns) {
  client_ = {address, PeerPort(socket.get())};
  socket_ = std::move(socket);
  has_requested_ = sending_ = false;
  last_request_ns_ = now_ns;
  deadline_ns_ = 0;
  in_size_ = out_begin_ = out_end_ = 0;
}

void TcpConnection::Close() {
  ::shutdown(socket_.get(), SHUT_RDWR);
  Release();
}

void TcpConnection::Release() {
  socket_.Reset();
  deadline_ns_ = 0;
}

TcpConnection::Received TcpConnection::Receive() {
  const std::size_t room = in_.size() - in_size_;
  const ssize_t received = ::recv(socket_.get(), in_.data() + in_size_, room, 0);
  if (received < 0 && errno == EAGAIN) return Received::kAll;
  if (received < 0 && errno == EINTR) return Received::kMore;
  if (received <= 0) return Received::kEnded;
  in_size_ += static_cast<std::size_t>(received);
  return static_cast<std::size_t>(received) < room ? Received::kAll : Received::kMore;
}

TcpConnection::Answered TcpConnection::AnswerFrames(RequestHandler& handler, std::uint8_t unit_id,
                                                    std::int64_t now_ns) {
  Answered answered;
  std::size_t begin = 0;
  TcpFrame frame;
  for (;;) {
    frame = ParseTcpFrame({in_.data() + begin, in_size_ - begin});
    if (frame.state != TcpFrame::State::kComplete) break;
    if (!Answer(frame, handler, unit_id)) answered.other_unit = frame.unit;
    ++answered.requests;
    begin += frame.size;
  }
  if (begin > 0) {
    has_requested_ = true;
    last_request_ns_ = now_ns;
    deadline_ns_ = 0;  // the frame it belonged to is complete
    in_size_ -= begin;
    if (in_size_ > 0) std::memmove(in_.data(), in_.data() + begin, in_size_);
  }
  if (in_size_ > 0 && deadline_ns_ == 0) deadline_ns_ = now_ns + kClientTimeout_ns;
  answered.intact = frame.state != TcpFrame::State::kBroken;
  return answered;
}

bool TcpConnection::Answer(const TcpFrame& frame, RequestHandler& handler, std::uint8_t unit_id) {
  std::uint8_t* out = out_.data() + out_end_;
  const std::span<std::uint8_t, kMaxPduBytes> response(out + kMbapBytes, kMaxPduBytes);
  const bool for_us =
      frame.unit == unit_id || frame.unit == 0 || frame.unit == 1 || frame.unit == 255;
  const std::size_t size =
      for_us ? handler.Handle(client_, frame.pdu, response)
             : WriteException(frame.pdu[0], Exception::kGatewayTargetFailed, response);
  if (size == 0) return for_us;
  WriteMbap(std::span<std::uint8_t, kMbapBytes>(out, kMbapBytes), frame.transaction, frame.unit,
            size);
  out_end_ += kMbapBytes + size;
  return for_us;
}

bool TcpConnection::Send(std::int64_t now_ns) {
  if (out_end_ == 0) return true;
  const ssize_t sent =
      ::send(socket_.get(), out_.data() + out_begin_, out_end_ - out_begin_, MSG_NOSIGNAL);
  if (sent < 0 && errno != EAGAIN && errno != EINTR) return false;
  if (sent > 0) out_begin_ += static_cast<std::size_t>(sent);
  const bool all = out_begin_ == out_end_;
  if (all) out_begin_ = out_end_ = 0;
  if (sending_ == all) {  // the pending state changes
    sending_ = !all;
    deadline_ns_ = sending_ || in_size_ > 0 ? now_ns + kClientTimeout_ns : 0;
  }
  return true;
}

namespace {

constexpr std::int64_t kListenPause_ns = 100'000'000;
constexpr int kAcceptsPerRound = 8;
// Edge-triggered, which saves the kernel from polling every answered client again. A client with
// more data than one receive takes, or that has hung up, must therefore be re-armed.
constexpr std::uint32_t kReadable = EPOLLIN | EPOLLRDHUP | EPOLLET;
constexpr std::uint32_t kListenerTag = 0xFFFFFFFF, kWakeTag = 0xFFFFFFFE;

std::int64_t Now_ns() {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Only the server's thread writes, so no atomic read-modify-write is needed.
void Add(std::atomic<std::uint64_t>& counter, std::uint64_t amount) {
  counter.store(counter.load(std::memory_order_relaxed) + amount, std::memory_order_relaxed);
}

}  // namespace

Result<std::unique_ptr<TcpServer>> TcpServer::Start(const TcpServerOptions& options,
                                                    RequestHandler& handler,
                                                    InheritedSockets inherited) {
  std::vector<IpAddress> allow;
  for (const std::string& text : options.allow) {
    const Result<IpAddress> address = ParseIpAddress(text);
    if (!address) return Error{"allow list: " + address.error()};
    if (std::find(allow.begin(), allow.end(), *address) == allow.end()) allow.push_back(*address);
  }
  if (options.max_clients < 1) return Error{"max_clients is below 1"};
  auto listener = inherited.listener ? Result(os::TcpListener(std::move(inherited.listener)))
                                     : os::TcpListener::Open(options.address, options.port);
  if (!listener) return listener.failure();
  std::unique_ptr<TcpServer> server(
      new TcpServer(options, std::move(allow), std::move(listener).value(), handler));
  if (!server->epoll_ || !server->wake_ || !server->spare_) {
    return Error{"cannot start the Modbus server: " + ErrnoText()};
  }
  server->TakeOver(std::move(inherited.connections));
  server->thread_ = std::thread([raw = server.get()] { raw->Run(); });
  ::pthread_setname_np(server->thread_.native_handle(), "modbus");
  return server;
}

TcpServer::TcpServer(const TcpServerOptions& options, std::vector<IpAddress> allow,
                     os::TcpListener listener, RequestHandler& handler)
    : handler_(handler),
      unit_id_(options.unit_id),
      allow_(std::move(allow)),
      on_event_(options.on_event),
      offers_connections_(options.offers_connections),
      clients_(std::max(static_cast<std::size_t>(options.max_clients), allow_.size())),
      offered_(clients_.size()),
      listener_(std::move(listener)),
      epoll_(::epoll_create1(EPOLL_CLOEXEC)),
      wake_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)),
      spare_(::open("/dev/null", O_RDONLY | O_CLOEXEC)) {
  for (std::atomic<int>& slot : offered_) slot = -1;
  epoll_event event{.events = EPOLLIN, .data = {.u32 = kListenerTag}};
  ::epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, listener_.fd(), &event);
  event.data.u32 = kWakeTag;
  ::epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, wake_.get(), &event);
}

TcpServer::~TcpServer() {
  if (thread_.joinable()) {
    ::eventfd_write(wake_.get(), 1);
    thread_.join();
  }
  for (TcpConnection& client : clients_) {
    if (!client.open()) continue;
    Withdraw(client);
    if (client.between_requests()) {
      client.Release();
    } else {
      client.Close();  // the next server could not resume in the middle of a frame
    }
  }
}

TcpServerCounters TcpServer::counters() const {
  const auto get = [](const auto& counter) { return counter.load(std::memory_order_relaxed); };
  return {.clients = get(counters_.clients),
          .accepted = get(counters_.accepted),
          .refused = get(counters_.refused),
          .evicted = get(counters_.evicted),
          .timeouts = get(counters_.timeouts),
          .not_reading = get(counters_.not_reading),
          .requests = get(counters_.requests)};
}

std::vector<os::Descriptor> TcpServer::TakeOffered() {
  std::vector<os::Descriptor> taken;
  for (std::atomic<int>& slot : offered_) {
    if (slot.load(std::memory_order_relaxed) < 0) continue;
    if (os::Descriptor copy(slot.exchange(-1)); copy) taken.push_back(std::move(copy));
  }
  return taken;
}

/// Called before the thread runs. Requests sent in the meantime wait in the sockets.
void TcpServer::TakeOver(std::vector<os::Descriptor> connections) {
  now_ns_ = Now_ns();
  for (os::Descriptor& connection : connections) {
    const int fd = connection.get();
    sockaddr_storage peer{};
    socklen_t size = sizeof peer;
    const bool alive = ::getpeername(fd, reinterpret_cast<sockaddr*>(&peer), &size) == 0;
    ::fcntl(fd, F_SETFL, ::fcntl(fd, F_GETFL) | O_NONBLOCK);
    if (alive && Admit(connection, IpAddressFromSocket(peer))) continue;
    ::shutdown(fd, SHUT_RDWR);  // also for other holders
  }
}

void TcpServer::Run() {
  sigset_t all;
  sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, nullptr);  // signals belong to the main thread
  std::array<epoll_event, 64> events;
  for (;;) {
    const int count =
        ::epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), WaitTime_ms());
    heartbeat_.Beat();
    now_ns_ = Now_ns();
    bool newcomers = false;
    for (int i = 0; i < count; ++i) {
      const epoll_event& event = events[static_cast<std::size_t>(i)];
      if (event.data.u32 == kWakeTag) return;
      if (event.data.u32 == kListenerTag) {
        newcomers = true;
      } else {
        Serve(clients_[event.data.u32], event.events);
      }
    }
    // Last, so that no event of this pass reaches a slot that was reassigned.
    if (newcomers) AcceptNewcomers();
    if (earliest_ns_ != 0 && now_ns_ >= earliest_ns_) CloseOverdue();
  }
}

os::Descriptor TcpServer::Accept(IpAddress& peer) const {
  sockaddr_storage from{};
  os::Descriptor socket = listener_.Accept(from);
  peer = IpAddressFromSocket(from);
  return socket;
}

void TcpServer::AcceptNewcomers() {
  for (int i = 0; i < kAcceptsPerRound; ++i) {
    IpAddress peer;
    if (os::Descriptor socket = Accept(peer)) {
      if (!Admit(socket, peer)) Add(counters_.refused, 1);
    } else if (errno == EMFILE || errno == ENFILE) {
      RefuseForLackOfDescriptors();
      return;
    } else if (errno == ENOBUFS || errno == ENOMEM) {
      WatchListener(false);
      return;
    } else if (errno == EAGAIN) {
      return;
    }
  }
}

/// @return true if the socket was assigned to a slot; otherwise the caller still owns it
bool TcpServer::Admit(os::Descriptor& socket, const IpAddress& address) {
  if (!allow_.empty() && std::find(allow_.begin(), allow_.end(), address) == allow_.end()) {
    ReportEvent(TcpServerEvent::Kind::kNotAllowed, address);
    return false;
  }
  TcpConnection* client = FindSlot(address);
  if (client == nullptr) {
    ReportEvent(TcpServerEvent::Kind::kNoFreeSlot, address);
    return false;
  }
  ConfigureClientSocket(socket.get());
  client->Open(std::move(socket), address, now_ns_);
  Watch(*client, EPOLL_CTL_ADD, kReadable);
  Add(counters_.accepted, 1);
  Add(counters_.clients, 1);
  return true;
}

TcpConnection* TcpServer::FindSlot(const IpAddress& newcomer) {
  for (TcpConnection& client : clients_) {
    if (!client.open()) return &client;
  }
  TcpConnection* evicted = ChooseEvicted(newcomer);
  if (evicted != nullptr) {
    Add(counters_.evicted, 1);
    ReportEvent(TcpServerEvent::Kind::kEvicted, evicted->address());
    Close(*evicted);
  }
  return evicted;
}

/// The connection that has been idle longest, preferring those that never sent a request. With an
/// allow list the only connection of another address is spared: its slot is reserved.
TcpConnection* TcpServer::ChooseEvicted(const IpAddress& newcomer) {
  TcpConnection* chosen = nullptr;
  for (TcpConnection& client : clients_) {
    const auto same_address = [&](const TcpConnection& other) {
      return other.address() == client.address();
    };
    if (!allow_.empty() && client.address() != newcomer &&
        std::count_if(clients_.begin(), clients_.end(), same_address) == 1) {
      continue;
    }
    if (chosen == nullptr || std::pair(client.has_requested(), client.last_request_ns()) <
                                 std::pair(chosen->has_requested(), chosen->last_request_ns())) {
      chosen = &client;
    }
  }
  return chosen;
}

/// Without a free descriptor the pending connection would wake the loop forever, so the spare
/// descriptor is released to accept and close it.
void TcpServer::RefuseForLackOfDescriptors() {
  spare_.Reset();
  IpAddress peer;
  os::Descriptor socket = Accept(peer);
  const bool accepted = static_cast<bool>(socket);
  if (accepted) {
    Add(counters_.refused, 1);
    ReportEvent(TcpServerEvent::Kind::kOutOfDescriptors, peer);
    socket.Reset();  // frees the descriptor for the spare
  }
  spare_.Reset(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  if (!accepted || !spare_) WatchListener(false);
}

void TcpServer::Serve(TcpConnection& client, std::uint32_t events) {
  if (!client.open()) return;
  const bool was_sending = client.sending();
  bool rearm = (events & (EPOLLRDHUP | EPOLLERR | EPOLLHUP)) != 0;
  bool alive = true;
  if (!was_sending) {
    const TcpConnection::Received received = client.Receive();
    rearm = rearm || received == TcpConnection::Received::kMore;
    alive = received != TcpConnection::Received::kEnded && Answer(client);
  } else if ((events & (EPOLLOUT | EPOLLERR | EPOLLHUP)) != 0) {
    alive = client.Send(now_ns_);
  }
  if (!alive) {
    Close(client);
    return;
  }
  if (client.sending() != was_sending) {
    Watch(client, EPOLL_CTL_MOD, client.sending() ? EPOLLOUT : kReadable);
  } else if (!was_sending && rearm) {
    Watch(client, EPOLL_CTL_MOD, kReadable);
  }
  if (earliest_ns_ == 0) earliest_ns_ = client.deadline_ns();
}

/// Answers the received frames. @return false if the connection is lost or its framing is broken
bool TcpServer::Answer(TcpConnection& client) {
  const bool newcomer = !client.has_requested();
  const TcpConnection::Answered answered = client.AnswerFrames(handler_, unit_id_, now_ns_);
  Add(counters_.requests, answered.requests);
  if (!client.Send(now_ns_)) return false;
  if (offers_connections_ && newcomer && client.has_requested()) Offer(client);
  if (answered.other_unit) ReportOtherUnit(client.address(), *answered.other_unit);
  if (!answered.intact) ReportEvent(TcpServerEvent::Kind::kBrokenFrame, client.address());
  return answered.intact;
}

void TcpServer::Offer(const TcpConnection& client) {
  const int fd = ::fcntl(client.fd(), F_DUPFD_CLOEXEC, 0);
  if (fd >= 0) offered_[SlotOf(client)] = fd;
}

void TcpServer::Withdraw(const TcpConnection& client) {
  const os::Descriptor closed(offered_[SlotOf(client)].exchange(-1));
}

std::size_t TcpServer::SlotOf(const TcpConnection& client) const {
  return static_cast<std::size_t>(&client - clients_.data());
}

void TcpServer::Close(TcpConnection& client) {
  if (!client.open()) return;
  Withdraw(client);
  // close() alone does not remove it from the epoll set while a duplicate is open.
  ::epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, client.fd(), nullptr);
  client.Close();
  Add(counters_.clients, static_cast<std::uint64_t>(-1));
}

void TcpServer::CloseOverdue() {
  earliest_ns_ = 0;
  const auto later = [this](std::int64_t deadline_ns) {
    earliest_ns_ = earliest_ns_ == 0 ? deadline_ns : std::min(earliest_ns_, deadline_ns);
  };
  if (listen_again_ns_ != 0) {
    if (now_ns_ >= listen_again_ns_) {
      WatchListener(true);
    } else {
      later(listen_again_ns_);
    }
  }
  for (TcpConnection& client : clients_) {
    if (client.deadline_ns() == 0) continue;
    if (now_ns_ < client.deadline_ns()) {
      later(client.deadline_ns());
      continue;
    }
    Add(client.sending() ? counters_.not_reading : counters_.timeouts, 1);
    ReportEvent(
        client.sending() ? TcpServerEvent::Kind::kNotReading : TcpServerEvent::Kind::kFrameTimeout,
        client.address());
    Close(client);
  }
}

int TcpServer::WaitTime_ms() const {
  constexpr std::int64_t kRest_ms =
      static_cast<std::int64_t>(1e3 * ThreadHeartbeat::kMaxBeatInterval_s);
  if (earliest_ns_ == 0) return kRest_ms;
  const std::int64_t left_ms = (earliest_ns_ - now_ns_) / 1'000'000 + 1;
  return static_cast<int>(std::clamp<std::int64_t>(left_ms, 0, kRest_ms));
}

void TcpServer::WatchListener(bool on) {
  listen_again_ns_ = on ? 0 : now_ns_ + kListenPause_ns;
  if (!on && (earliest_ns_ == 0 || listen_again_ns_ < earliest_ns_)) {
    earliest_ns_ = listen_again_ns_;
  }
  epoll_event event{.events = on ? EPOLLIN : 0U, .data = {.u32 = kListenerTag}};
  ::epoll_ctl(epoll_.get(), EPOLL_CTL_MOD, listener_.fd(), &event);
}

/// A client that reconnects for each request must not fill the log: once for address and id.
void TcpServer::ReportOtherUnit(const IpAddress& address, std::uint8_t unit_id) {
  const auto end = other_units_.begin() + static_cast<std::ptrdiff_t>(other_units_count_);
  const bool reported = std::any_of(other_units_.begin(), end, [&](const OtherUnit& one) {
    return one.address == address && one.unit_id == unit_id;
  });
  if (reported || end == other_units_.end()) return;
  other_units_[other_units_count_++] = {address, unit_id};
  ReportEvent(TcpServerEvent::Kind::kOtherUnit, address, unit_id);
}

void TcpServer::ReportEvent(TcpServerEvent::Kind kind, const IpAddress& address,
                            int unit_id) const {
  if (!on_event_) return;
  const auto text = IpAddressText(address);
  on_event_({.kind = kind, .peer = text.data(), .unit_id = unit_id});
}

void TcpServer::Watch(const TcpConnection& client, int operation, std::uint32_t events) const {
  epoll_event event{.events = events, .data = {.u32 = static_cast<std::uint32_t>(SlotOf(client))}};
  ::epoll_ctl(epoll_.get(), operation, client.fd(), &event);
}

}  // namespace plumbline::modbus
