#include "tests/drivers/robot/fake_controller.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <stdexcept>

namespace plumbline::robot {
namespace {

int WordAt(const Bytes& bytes, int at) {
  const auto place = static_cast<std::size_t>(at);
  return bytes[place] << 8 | bytes[place + 1];
}

void PutWord(Bytes& bytes, int word) {
  bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  bytes.push_back(static_cast<std::uint8_t>(word & 0xFF));
}

}  // namespace

FakeController::FakeController() {
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  auto* raw = reinterpret_cast<sockaddr*>(&address);
  if (bind(listener_, raw, size) != 0 || listen(listener_, 8) != 0 ||
      getsockname(listener_, raw, &size) != 0) {
    throw std::runtime_error("no loopback socket");
  }
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] { Run(); });
}

FakeController::~FakeController() {
  stop_ = true;
  thread_.join();
  close(listener_);
}

void FakeController::Behave(Behaviour behaviour) {
  const std::lock_guard lock(mutex_);
  behaviour_ = std::move(behaviour);
}

void FakeController::OnWrite(std::function<void(int, std::array<std::uint16_t, 1024>&)> on_write) {
  const std::lock_guard lock(mutex_);
  on_write_ = std::move(on_write);
}

void FakeController::Set(int address, std::uint16_t word) {
  const std::lock_guard lock(mutex_);
  registers_.at(static_cast<std::size_t>(address)) = word;
}

std::uint16_t FakeController::Get(int address) const {
  const std::lock_guard lock(mutex_);
  return registers_.at(static_cast<std::size_t>(address));
}

bool FakeController::Send(int fd, const Bytes& bytes) {
  return send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL) >= 0;
}

void FakeController::Run() {
  while (!stop_) {
    pollfd waiting{listener_, POLLIN, 0};
    if (poll(&waiting, 1, 10) <= 0) continue;
    const int fd = accept(listener_, nullptr, nullptr);
    if (fd < 0) continue;
    const int at_once = 1;
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &at_once, sizeof(at_once));
    ++connections_;
    Serve(fd);
    close(fd);
  }
}

bool FakeController::ReadRequest(int fd, Bytes& request) const {
  request.clear();
  std::size_t wanted = 6;
  while (request.size() < wanted) {
    pollfd waiting{fd, POLLIN, 0};
    if (stop_) return false;
    if (poll(&waiting, 1, 10) <= 0) continue;
    std::array<std::uint8_t, 300> buffer{};
    const auto count = recv(fd, buffer.data(), wanted - request.size(), 0);
    if (count <= 0) return false;
    request.insert(request.end(), buffer.begin(), buffer.begin() + count);
    if (request.size() == 6) wanted = 6U + static_cast<std::size_t>(WordAt(request, 4));
  }
  return true;
}

void FakeController::Serve(int fd) {
  Exchange exchange;
  while (ReadRequest(fd, exchange.request)) {
    exchange.number = ++requests_;
    exchange.connection = connections_;
    exchange.fd = fd;
    exchange.answer = AnswerTo(exchange.request);
    Behaviour behaviour;
    {
      const std::lock_guard lock(mutex_);
      behaviour = behaviour_;
    }
    const Then then = behaviour ? behaviour(exchange) : Then::kAnswer;
    if (then == Then::kClose) return;
    if (then == Then::kAnswer) Send(fd, exchange.answer);
  }
}

Bytes FakeController::AnswerTo(const Bytes& request) {
  const std::lock_guard lock(mutex_);
  Bytes pdu = {request[6], request[7]};
  const int first = WordAt(request, 8);
  const auto put = [this](int address, int word) {
    registers_.at(static_cast<std::size_t>(address)) = static_cast<std::uint16_t>(word);
    if (on_write_) on_write_(address, registers_);
  };
  const int count = WordAt(request, 10);  // count for FC03 and FC16, value for FC06
  if (first + (request[7] == 6 ? 1 : count) > static_cast<int>(registers_.size())) {
    pdu = {request[6], static_cast<std::uint8_t>(request[7] | 0x80), 2};
  } else if (request[7] == 3) {
    pdu.push_back(static_cast<std::uint8_t>(2 * count));
    for (int i = first; i < first + count; ++i) {
      PutWord(pdu, registers_.at(static_cast<std::size_t>(i)));
    }
  } else if (request[7] == 6) {
    put(first, count);
    pdu.insert(pdu.end(), request.begin() + 8, request.begin() + 12);
  } else if (request[7] == 16) {
    for (int i = 0; i < count; ++i) {
      put(first + i, WordAt(request, 13 + 2 * i));
    }
    pdu.insert(pdu.end(), request.begin() + 8, request.begin() + 12);
  } else {
    pdu = {request[6], static_cast<std::uint8_t>(request[7] | 0x80), 1};
  }
  Bytes answer(request.begin(), request.begin() + 4);
  PutWord(answer, static_cast<int>(pdu.size()));
  answer.insert(answer.end(), pdu.begin(), pdu.end());
  return answer;
}

}  // namespace plumbline::robot
