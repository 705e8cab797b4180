#include "tests/bench/modbus_load.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <deque>
#include <functional>
#include <stdexcept>
#include <thread>
#include <utility>

namespace plumbline::bench {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Clock = std::chrono::steady_clock;

double Seconds(Clock::duration time) {
  return std::chrono::duration<double>(time).count();
}
void Sleep_ms(int time_ms) {
  std::this_thread::sleep_for(std::chrono::milliseconds(time_ms));
}

constexpr std::size_t AnswerBytes(int count) {
  return 9 + 2 * static_cast<std::size_t>(count);
}

// ---- Hostile clients; each function is the body of one thread.

void SendPartialFrames(int port) {
  for (;;) {
    const Connection connection(port);
    if (connection.ok()) connection.Send(std::array<std::uint8_t, 5>{0, 1, 0, 0, 0});
    std::array<std::uint8_t, 16> nothing;
    connection.Receive(nothing);  // until closed, or for one second
  }
}

void DripBytes(int port) {
  for (;;) {
    const Connection connection(port);
    const Bytes frame = ReadRequest(10);
    for (const std::uint8_t byte : frame) {
      if (!connection.Send({&byte, 1})) break;
      Sleep_ms(200);
    }
  }
}

void NeverRead(int port) {
  Bytes flood;
  for (int i = 0; i < 20; ++i) {
    const Bytes frame = ReadRequest(125);
    flood.insert(flood.end(), frame.begin(), frame.end());
  }
  for (;;) {
    const Connection connection(port, 4096);
    const auto end = Clock::now() + std::chrono::seconds(3);
    while (connection.ok() && Clock::now() < end) {
      const ssize_t sent =
          ::send(connection.fd(), flood.data(), flood.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent < 0 && errno != EAGAIN) break;
      if (sent < 0) Sleep_ms(1);
    }
  }
}

void RequestUnknownFunctions(int port) {
  const std::array<std::uint8_t, 12> frame = {0, 1, 0, 0, 0, 6, 1, 0x55, 1, 2, 3, 4};
  for (;;) {
    const Connection connection(port);
    std::array<std::uint8_t, 9> answer;
    while (connection.Send(frame) && connection.Receive(answer)) {
    }
  }
}

void OpenAndAbandon(int port) {
  std::vector<Connection> abandoned;
  for (int i = 0;; ++i) {
    Connection connection(port);
    const linger reset{.l_onoff = 1, .l_linger = 0};  // avoids TIME_WAIT
    ::setsockopt(connection.fd(), SOL_SOCKET, SO_LINGER, &reset, sizeof reset);
    if (i % 2 == 0) abandoned.push_back(std::move(connection));
    if (abandoned.size() == 100) abandoned.clear();
    Sleep_ms(1);
  }
}

/// Starts a non-blocking connect().
int BeginConnection(int port) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const linger reset{.l_onoff = 1, .l_linger = 0};  // avoids TIME_WAIT
  ::setsockopt(fd, SOL_SOCKET, SO_LINGER, &reset, sizeof reset);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  static_cast<void>(::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address));
  return fd;
}

/// Repeated bursts that keep the accept queue full most of the time.
void FillAcceptQueue(int port) {
  constexpr int kTotal = 30'000, kBurst = 600;
  std::vector<int> open;
  for (int i = 0; i < kTotal; ++i) {
    open.push_back(BeginConnection(port));
    if (open.size() < kBurst) continue;
    Sleep_ms(20);
    for (const int fd : open) ::close(fd);
    open.clear();
  }
}

/// 10,000 silent connections that stay open until the server closes them.
void TenThousandConnections(int port) {
  constexpr int kTotal = 10'000, kHeld = 800;
  std::deque<int> open;
  for (int i = 0; i < kTotal; ++i) {
    open.push_back(BeginConnection(port));
    if (i % 20 == 0) Sleep_ms(2);
    if (open.size() < kHeld) continue;
    ::close(open.front());
    open.pop_front();
  }
  for (;;) ::pause();
}

struct ClientGroup {
  int count;
  void (*run)(int port);
};

std::vector<ClientGroup> GroupsOf(Attack attack) {
  switch (attack) {
    case Attack::kAcceptQueue:
      return {{1, FillAcceptQueue}};
    case Attack::kTenThousand:
      return {{1, TenThousandConnections}};
    case Attack::kAbandon:
      return {{4, OpenAndAbandon}};
    case Attack::kMixed:
      break;
  }
  return {{4, SendPartialFrames},
          {4, DripBytes},
          {2, NeverRead},
          {2, RequestUnknownFunctions},
          {1, OpenAndAbandon}};
}

}  // namespace

Bytes ReadRequest(int count) {
  return {0, 1, 0, 0, 0, 6, 1, 3, 0, 0, 0, static_cast<std::uint8_t>(count)};
}

Connection::Connection(int port, int receive_buffer_bytes)
    : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const int on = 1;
  const timeval timeout{.tv_sec = 1, .tv_usec = 0};
  ::setsockopt(fd_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
  if (receive_buffer_bytes > 0) {
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof receive_buffer_bytes);
  }
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  if (::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    ::close(std::exchange(fd_, -1));
    Sleep_ms(1);
  }
}

Connection::Connection(Connection&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

Connection::~Connection() {
  if (fd_ >= 0) ::close(fd_);
}

bool Connection::Send(std::span<const std::uint8_t> bytes) const {
  return ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
         static_cast<ssize_t>(bytes.size());
}

bool Connection::Receive(std::span<std::uint8_t> bytes) const {
  while (!bytes.empty()) {
    const ssize_t got = ::recv(fd_, bytes.data(), bytes.size(), 0);
    if (got <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(got));
  }
  return true;
}

RoundTrips MeasureRoundTrips(int port, int polls) {
  const Connection connection(port);
  const Bytes request = ReadRequest(10);
  Bytes answer(AnswerBytes(10));
  std::vector<double> times_us;
  times_us.reserve(static_cast<std::size_t>(polls));
  for (int i = -polls / 10; i < polls; ++i) {  // the first tenth is warm-up
    const auto start = Clock::now();
    if (!connection.Send(request) || !connection.Receive(answer)) {
      throw std::runtime_error("round trip failed");
    }
    if (i >= 0) times_us.push_back(1e6 * Seconds(Clock::now() - start));
  }
  std::sort(times_us.begin(), times_us.end());
  return {.p50_us = times_us[times_us.size() / 2], .p99_us = times_us[times_us.size() * 99 / 100]};
}

double MeasureRate(int port, int clients, int requests) {
  std::vector<Connection> connections;
  connections.reserve(static_cast<std::size_t>(clients));
  for (int i = 0; i < clients; ++i) connections.emplace_back(port);
  const Bytes request = ReadRequest(10);
  Bytes answer(AnswerBytes(10));
  const auto round = [&] {
    bool ok = true;
    for (const Connection& connection : connections) ok = connection.Send(request) && ok;
    for (const Connection& connection : connections) ok = connection.Receive(answer) && ok;
    if (!ok) throw std::runtime_error("a client was not answered");
  };
  for (int i = 0; i < 10; ++i) round();
  const int rounds = requests / clients;
  const auto start = Clock::now();
  for (int i = 0; i < rounds; ++i) round();
  return rounds * clients / Seconds(Clock::now() - start);
}

GoodClient PollEveryMillisecond(int port, std::size_t answer_bytes, double duration_s) {
  GoodClient good;
  const Bytes request = ReadRequest(10);
  Bytes answer(answer_bytes);
  std::vector<Connection> connection;
  connection.emplace_back(port);
  const auto begin = Clock::now();
  auto next = begin;
  while (Seconds(next - begin) < duration_s && !good.locked_out) {
    std::this_thread::sleep_until(next += std::chrono::milliseconds(1));
    const auto start = Clock::now();
    for (int tries = 0; !connection[0].Send(request) || !connection[0].Receive(answer); ++tries) {
      good.locked_out = tries == 10;
      if (good.locked_out) break;
      ++good.reconnections;
      connection.clear();
      connection.emplace_back(port);
    }
    const auto end = Clock::now();
    good.worst_ms = std::max(good.worst_ms, 1e3 * Seconds(end - start));
    ++good.polls;
    next = std::max(next, end);
  }
  return good;
}

constexpr int kHostileNice = 19;

HostileClients::HostileClients(int port, Attack attack) : pid_(::fork()) {
  if (pid_ < 0) throw std::runtime_error("cannot fork the hostile clients");
  if (pid_ > 0) return;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  // In the field hostile clients run on other machines. Here they get low priority so that the
  // server is measured, not the scheduler.
  static_cast<void>(::setpriority(PRIO_PROCESS, 0, kHostileNice));
  for (const auto& [count, run] : GroupsOf(attack)) {
    for (int i = 0; i < count; ++i) std::thread(run, port).detach();
  }
  for (;;) ::pause();
}

HostileClients::~HostileClients() {
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

TornReads ReadBlocks(int port, int reads) {
  constexpr int kRegisters = 40, kOutstanding = 8;
  const Connection connection(port);
  Bytes requests;
  for (int i = 0; i < kOutstanding; ++i) {
    const Bytes request = ReadRequest(kRegisters);
    requests.insert(requests.end(), request.begin(), request.end());
  }
  Bytes answers(kOutstanding * AnswerBytes(kRegisters));
  TornReads result;
  int last = -1;
  while (result.reads < reads) {
    if (!connection.Send(requests) || !connection.Receive(answers)) {
      throw std::runtime_error("block read failed");
    }
    for (std::size_t k = 0; k < kOutstanding; ++k) {
      const std::uint8_t* data = answers.data() + k * AnswerBytes(kRegisters) + 9;
      const auto word = [data](std::size_t i) { return (data[2 * i] << 8) | data[2 * i + 1]; };
      bool whole = true;
      for (int i = 0; i < kRegisters; ++i) {
        whole = whole && word(static_cast<std::size_t>(i)) == ((word(0) + i) & 0xFFFF);
      }
      if (!whole) ++result.torn;
      if (word(0) != last) ++result.images;
      last = word(0);
      ++result.reads;
    }
  }
  return result;
}

}  // namespace plumbline::bench
