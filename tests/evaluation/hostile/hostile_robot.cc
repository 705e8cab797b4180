#include "tests/evaluation/hostile/hostile_robot.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <stdexcept>

namespace hostile {
namespace {

constexpr std::uint32_t kOtherUnitAhead = 10'000'000;

double Now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

unsigned Crc(const Bytes& bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? crc >> 1 ^ 0xA001 : crc >> 1;
  }
  return crc;
}

int WordAt(const Bytes& bytes, std::size_t at) {
  return bytes[at] << 8 | bytes[at + 1];
}

void Put(Bytes& bytes, int word) {
  bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  bytes.push_back(static_cast<std::uint8_t>(word & 0xFF));
}

}  // namespace

std::size_t PduAt(bool serial) {
  return serial ? 1 : 7;
}

Bytes Frame(bool serial, const Bytes& request, std::uint8_t unit, const Bytes& pdu) {
  Bytes frame;
  if (!serial) {
    frame.assign(request.begin(), request.begin() + 2);
    Put(frame, 0);
    Put(frame, static_cast<int>(pdu.size()) + 1);
  }
  frame.push_back(unit);
  frame.insert(frame.end(), pdu.begin(), pdu.end());
  if (serial) {
    const unsigned crc = Crc(frame);
    frame.push_back(static_cast<std::uint8_t>(crc & 0xFF));
    frame.push_back(static_cast<std::uint8_t>(crc >> 8));
  }
  return frame;
}

HostileRobot::HostileRobot(const Kind& kind, bool serial, Ticks ticks, unsigned seed, double slower)
    : kind_(kind), serial_(serial), ticks_(std::move(ticks)), slower_(slower), random_(seed) {
  sampled_ = ticks_();
  if (serial_) {
    OpenTerminal();
  } else {
    OpenSocket();
  }
  thread_ = std::thread([this] { Run(); });
}

HostileRobot::~HostileRobot() {
  stop_ = true;
  thread_.join();
  for (const int fd : {listener_, terminal_, kept_open_}) {
    if (fd >= 0) close(fd);
  }
}

void HostileRobot::OpenSocket() {
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
}

void HostileRobot::OpenTerminal() {
  terminal_ = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  char name[128];
  if (terminal_ < 0 || grantpt(terminal_) != 0 || unlockpt(terminal_) != 0 ||
      ptsname_r(terminal_, name, sizeof(name)) != 0) {
    throw std::runtime_error("no pseudo-terminal");
  }
  kept_open_ = open(name, O_RDWR | O_NOCTTY | O_CLOEXEC);  // closing the client is no hang-up
  termios raw{};
  tcgetattr(kept_open_, &raw);
  cfmakeraw(&raw);
  tcsetattr(kept_open_, TCSANOW, &raw);
  device_ = name;
}

void HostileRobot::Run() {
  if (serial_) {
    Serve(terminal_);
    return;
  }
  while (!stop_) {
    pollfd waiting{listener_, POLLIN, 0};
    if (poll(&waiting, 1, 5) <= 0) continue;
    const int fd = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (fd < 0) continue;
    const int at_once = 1;
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &at_once, sizeof(at_once));
    // What is still to be sent goes to the new connection: a gateway may do that.
    Serve(fd);
    close(fd);
  }
}

void HostileRobot::Serve(int fd) {
  Bytes stream;
  while (!stop_) {
    SendDue(fd);
    double wait_s = 0.005;
    for (const Due& due : due_) wait_s = std::min(wait_s, due.at_s - Now_s());
    timespec wait{};
    wait.tv_nsec = static_cast<long>(1e9 * std::max(wait_s, 0.0));
    pollfd waiting{fd, POLLIN, 0};
    if (ppoll(&waiting, 1, &wait, nullptr) > 0 && !Receive(fd, stream)) return;
  }
}

/// All requests of the evaluation are reads: 12 bytes over TCP, 8 on a serial line.
bool HostileRobot::Receive(int fd, Bytes& stream) {
  std::uint8_t buffer[512];
  const auto count = read(fd, buffer, sizeof(buffer));
  if (count <= 0) return serial_;
  stream.insert(stream.end(), buffer, buffer + count);
  const std::size_t size = serial_ ? 8 : 12;
  while (stream.size() >= size) {
    const auto end = stream.begin() + static_cast<std::ptrdiff_t>(size);
    Handle(Bytes(stream.begin(), end));
    stream.erase(stream.begin(), end);
  }
  return true;
}

std::uint16_t HostileRobot::Word(int address, int unit, std::uint32_t time) const {
  const int block = address < 100 ? 1 : 2;
  const unsigned high = time >> 16, low = time & 0xFFFF;
  const auto number = static_cast<unsigned>(refreshes_);
  switch (address % 100) {
    case 0:
      return static_cast<std::uint16_t>(high);
    case 1:
      return static_cast<std::uint16_t>(low);
    case 2:
      return static_cast<std::uint16_t>(unit);
    case 3:
      return static_cast<std::uint16_t>(block);
    case 4:
      return refreshes_;
    case 5:
      return static_cast<std::uint16_t>(high * 7 + low * 5 + number * 3 +
                                        static_cast<unsigned>(unit * 11 + block * 13));
    default:
      return static_cast<std::uint16_t>(address * 257);
  }
}

Bytes HostileRobot::AnswerPdu(const Bytes& request_pdu, int unit) {
  const int first = WordAt(request_pdu, 1), count = WordAt(request_pdu, 3);
  Bytes pdu = {request_pdu[0], static_cast<std::uint8_t>(2 * count)};
  const std::uint32_t time = sampled_ + (unit == 1 ? 0 : kOtherUnitAhead);
  for (int i = 0; i < count; ++i) Put(pdu, Word(first + i, unit, time));
  return pdu;
}

void HostileRobot::Handle(const Bytes& request) {
  if (kind_.refresh == Refresh::kAtRequest) {
    sampled_ = ticks_();
    ++refreshes_;
  }
  const std::size_t at = PduAt(serial_);
  const Bytes pdu(request.begin() + static_cast<std::ptrdiff_t>(at),
                  request.begin() + static_cast<std::ptrdiff_t>(at + 5));
  Exchange exchange{.number = ++number_,
                    .serial = serial_,
                    .request = request,
                    .answer = Frame(serial_, request, request[at - 1], AnswerPdu(pdu, 1)),
                    .other_unit = Frame(serial_, request, 2, AnswerPdu(pdu, 2)),
                    .previous_answer = previous_,
                    .earlier_twin = {},
                    .random = random_};
  const auto twin = std::find_if(twins_.begin(), twins_.end(),
                                 [&pdu](const auto& entry) { return entry.first == pdu; });
  if (twin != twins_.end()) exchange.earlier_twin = twin->second;
  previous_ = exchange.answer;
  if (twin != twins_.end()) {
    twin->second = exchange.answer;
  } else {
    twins_.emplace_back(pdu, exchange.answer);
  }
  for (Emission& emission : kind_.behave(exchange)) {
    double at_s = Now_s() + slower_ * emission.delay_s;
    if (!emission.overtakes) last_s_ = at_s = std::max(at_s, last_s_);
    due_.push_back({at_s, std::move(emission.bytes)});
  }
  const bool refresh = kind_.refresh == Refresh::kEachRead ||
                       (kind_.refresh == Refresh::kSometimes && random_() % 3 == 0);
  if (refresh) {
    sampled_ = ticks_();
    ++refreshes_;
  }
}

void HostileRobot::SendDue(int fd) {
  std::stable_sort(due_.begin(), due_.end(),
                   [](const Due& a, const Due& b) { return a.at_s < b.at_s; });
  while (!due_.empty() && due_.front().at_s <= Now_s()) {
    const Bytes& bytes = due_.front().bytes;
    // Lost if the client has closed the connection; what is due later goes to the next one.
    const auto sent = serial_ ? write(fd, bytes.data(), bytes.size())
                              : send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    static_cast<void>(sent);
    due_.erase(due_.begin());
  }
}

}  // namespace hostile
