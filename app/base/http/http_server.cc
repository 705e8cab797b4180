#include "app/base/http/http_server.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <optional>
#include <system_error>

#include "drivers/clock.h"

namespace plumbline::http {
namespace {

/// @return  true if the descriptor is ready or broken, which the next call on it reports
bool WaitFor(int fd, short events, double until_s) {
  for (;;) {
    const double left_s = until_s - MonotonicSeconds();
    if (left_s <= 0) return false;
    pollfd waiting{fd, events, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(1e3 * left_s) + 1);
    if (ready > 0) return true;
    if (ready < 0 && errno != EINTR) return false;
  }
}

}  // namespace

HttpConnection::HttpConnection(int fd, ConnectionLimits limits, double now_s)
    : fd_(fd), limits_(limits), read_until_s_(now_s + limits.request_s) {}

HttpConnection::Head HttpConnection::ReadHead(std::string& head) {
  char bytes[2048];
  while (head.size() < limits_.request_bytes) {
    if (!WaitFor(fd_, POLLIN, read_until_s_)) return Head::kTooSlow;
    const std::size_t room = std::min(sizeof bytes, limits_.request_bytes - head.size());
    const ssize_t got = recv(fd_, bytes, room, 0);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) continue;
    if (got <= 0) return Head::kLost;
    const std::size_t seen = head.size();
    head.append(bytes, static_cast<std::size_t>(got));
    if (const auto end = EndOfHead(head, seen)) {
      head.resize(*end);
      return Head::kComplete;
    }
  }
  return Head::kTooLong;
}

bool HttpConnection::IsWritable() const {
  if (!WaitFor(fd_, POLLOUT, MonotonicSeconds() + limits_.write_s)) return false;
  pollfd now{fd_, POLLRDHUP, 0};
  poll(&now, 1, 0);
  return (now.revents & (POLLERR | POLLHUP | POLLRDHUP)) == 0;
}

bool HttpConnection::Write(std::string_view bytes) {
  const double begun_s = MonotonicSeconds(), end_s = begun_s + limits_.answer_s;
  double until_s = begun_s + limits_.write_s;
  while (!bytes.empty()) {
    const ssize_t n = send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (n > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(n));
      until_s = MonotonicSeconds() + limits_.write_s;
      if (!bytes.empty() && MonotonicSeconds() >= end_s) return false;
      continue;
    }
    const bool broken = n < 0 && errno != EAGAIN && errno != EINTR;
    if (broken || !WaitFor(fd_, POLLOUT, std::min(until_s, end_s))) return false;
  }
  return true;
}

namespace {

constexpr int kSendBuffer = 128 * 1024;  ///< a larger buffer would delay the live picture
constexpr int kPauseWithoutDescriptors_ms = 100;
constexpr double kLinger_s = 0.5;
constexpr std::size_t kLingerBytes = 64U << 10U;

void SendShort(int fd, const char* status) {
  const std::string answer =
      fmt::format("HTTP/1.1 {}\r\nConnection: close\r\nContent-Length: 0\r\n\r\n", status);
  send(fd, answer.data(), answer.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

/// Reads what the client is still sending: closing at once would reset the connection, and the
/// client might lose the response.
void LingeringClose(int fd) {
  shutdown(fd, SHUT_WR);
  const double until_s = MonotonicSeconds() + kLinger_s;
  char bytes[4096];
  for (std::size_t taken = 0; taken < kLingerBytes;) {
    pollfd waiting{fd, POLLIN, 0};
    const double left_s = until_s - MonotonicSeconds();
    if (left_s <= 0 || poll(&waiting, 1, static_cast<int>(1e3 * left_s) + 1) <= 0) return;
    const ssize_t n = recv(fd, bytes, sizeof bytes, 0);
    if (n <= 0) return;
    taken += static_cast<std::size_t>(n);
  }
}

/// @return  nullopt if the client closed without sending anything, as browsers' spare connections
///          do
std::optional<ParsedRequest> RequestOf(HttpConnection& connection) {
  using Head = HttpConnection::Head;
  std::string head;
  switch (connection.ReadHead(head)) {
    case Head::kTooLong:
      return ParsedRequest{431, "the request is too long", {}};
    case Head::kTooSlow:
      return ParsedRequest{408, "the request is incomplete", {}};
    case Head::kLost:
      if (head.empty()) return std::nullopt;
      return ParsedRequest{400, "the request is incomplete", {}};
    case Head::kComplete:
      break;
  }
  return ParseRequest(head);
}

}  // namespace

HttpServer::HttpServer(os::TcpListener listener, ConnectionLimits limits, Answer answer)
    : answer_(std::move(answer)),
      limits_(limits),
      listener_(std::move(listener)),
      wake_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}

void HttpServer::Start() {
  thread_ = std::thread([this] { Run(); });
  pthread_setname_np(thread_.native_handle(), "page");
}

HttpServer::~HttpServer() {
  ending_ = true;
  eventfd_write(wake_.get(), 1);
  if (thread_.joinable()) thread_.join();
  for (Slot& slot : slots_) {
    if (slot.socket) shutdown(slot.socket.get(), SHUT_RDWR);
    Free(slot);
  }
}

void HttpServer::Run() {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, nullptr);  // signals belong to the main thread
  for (;;) {
    std::array<pollfd, 2> waiting{{{wake_.get(), POLLIN, 0}, {listener_.fd(), POLLIN, 0}}};
    poll(waiting.data(), waiting.size(), -1);
    if (waiting[0].revents != 0) return;
    sockaddr_storage from{};
    if (os::Descriptor socket = listener_.Accept(from)) {
      Admit(std::move(socket), os::EndpointOf(from).address);
    } else if (errno == EMFILE || errno == ENFILE || errno == ENOMEM || errno == ENOBUFS) {
      poll(waiting.data(), 1, kPauseWithoutDescriptors_ms);
    }
  }
}

void HttpServer::Free(Slot& slot) {
  if (slot.thread.joinable()) slot.thread.join();
  slot.socket.Reset();
}

void HttpServer::Admit(os::Descriptor socket, const std::string& peer) {
  Slot* free = nullptr;
  std::size_t of_peer = 0;
  for (Slot& slot : slots_) {
    // Read once: a slot that ends in between would be reused with its thread not joined.
    if (slot.done) {
      Free(slot);
      free = &slot;
    } else if (slot.peer == peer) {
      ++of_peer;
    }
  }
  if (free == nullptr || of_peer >= kMaxPerPeer) {
    ++rejected_;
    SendShort(socket.get(), "503 Service Unavailable");
    return;
  }
  setsockopt(socket.get(), SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer);
  free->socket = std::move(socket);
  free->peer = peer;
  free->done = false;
  ++connections_;
  try {
    free->thread = std::thread([this, free] { Serve(*free); });
    pthread_setname_np(free->thread.native_handle(), "page-answer");
  } catch (const std::system_error&) {  // out of threads or memory
    ++rejected_;
    SendShort(free->socket.get(), "503 Service Unavailable");
    --connections_;
    free->done = true;
    Free(*free);
  }
}

void HttpServer::HandleRequest(HttpConnection& connection, const std::string& peer) const {
  std::optional<ParsedRequest> parsed = RequestOf(connection);
  if (!parsed) return;
  HttpRequest& request = parsed->request;
  request.peer = peer;
  HttpResponse response;
  if (parsed->refusal != 0) {
    response.Refuse(parsed->refusal, parsed->why);
  } else {
    try {
      answer_(request, response);
    } catch (const std::exception&) {  // out of memory or descriptors, or invalid UTF-8
      response = {};
      response.Refuse(500, "internal error");
    }
  }
  const bool head_alone = request.method == "HEAD";
  if (!connection.Write(HeadOf(response) + (head_alone ? "" : response.body)) || head_alone) return;
  const HttpWrite write = [&](std::string_view part) {
    return !ending_ && (part.empty() ? connection.IsWritable() : connection.Write(part));
  };
  while (response.stream && !ending_ && response.stream(write)) continue;
}

void HttpServer::Serve(Slot& slot) {
  HttpConnection connection(slot.socket.get(), limits_, MonotonicSeconds());
  try {
    HandleRequest(connection, slot.peer);
  } catch (const std::exception&) {
    // Out of memory even for the error response; only this request fails.
  }
  LingeringClose(slot.socket.get());
  shutdown(slot.socket.get(), SHUT_RDWR);  // the accepting thread closes the descriptor
  --connections_;
  slot.done = true;
}

}  // namespace plumbline::http
