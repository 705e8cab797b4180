#include "drivers/robot/register_client.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <memory>
#include <system_error>

#include "drivers/modbus/adu.h"
#include "drivers/os/await.h"

namespace plumbline::robot {
namespace {

using Kind = ReadOutcome::Kind;

std::string ErrnoText(int error) {
  switch (error) {
    case ECONNREFUSED:
      return "nothing accepts connections at this address and port";
    case ETIMEDOUT:
    case EHOSTUNREACH:
    case ENETUNREACH:
      return "no route, or no such host in this network";
    default:
      return std::generic_category().message(error);
  }
}

}  // namespace

const char* ExceptionText(int code) {
  switch (code) {
    case 1:
      return "the device does not know the function";
    case 2:
      return "no such register";
    case 3:
      return "count or value not allowed";
    case 4:
      return "failure in the device";
    case 5:
      return "accepted, not done yet";
    case 6:
      return "the device is busy";
    case 10:
      return "the gateway has no path to this unit id";
    case 11:
      return "no device behind the gateway answers to this unit id";
    default:
      return "a code of the manufacturer";
  }
}

std::string ReadOutcome::Text() const {
  switch (kind) {
    case Kind::kWords:
      return fmt::format("{} registers", words.size());
    case Kind::kException:
      return fmt::format("exception 0x{:02X} ({})", exception, ExceptionText(exception));
    case Kind::kSilent:
      return "no answer in time";
    case Kind::kClosed:
      return "the device closed the connection instead of answering";
    case Kind::kForeign:
      return "the answer does not belong to the request: " + what;
    case Kind::kUnreachable:
      return what;
  }
  return "";
}

bool RegisterClient::Connect(std::string& why) {
  const std::string service = std::to_string(options_.port);
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(options_.host.c_str(), service.c_str(), &wanted, &found)) {
    why = fmt::format("the name {} is not known ({})", options_.host, gai_strerror(error));
    return false;
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> list(found, &freeaddrinfo);
  int error = EHOSTUNREACH;
  for (const addrinfo* one = list.get(); one != nullptr; one = one->ai_next) {
    socket_.Reset(socket(one->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (!socket_) continue;
    error = connect(socket_.get(), one->ai_addr, one->ai_addrlen) == 0 ? 0 : errno;
    if (error == EINPROGRESS) {
      error = ETIMEDOUT;
      socklen_t size = sizeof error;
      if (os::Await(socket_.get(), POLLOUT, MonotonicSeconds() + std::max(1.0, options_.timeout_s)))
        getsockopt(socket_.get(), SOL_SOCKET, SO_ERROR, &error, &size);
    }
    if (error != 0) continue;
    const int no_delay = 1;
    setsockopt(socket_.get(), IPPROTO_TCP, TCP_NODELAY, &no_delay, sizeof no_delay);
    answered_ = false;
    return true;
  }
  socket_.Reset();
  why = ErrnoText(error);
  return false;
}

ReadOutcome RegisterClient::Exchange(Bytes request, Framing framing, const RegisterBlock& block) {
  ReadOutcome answer;
  const double sent_s = MonotonicSeconds();
  std::array<std::uint8_t, modbus::kMaxTcpFrameBytes> received{};
  answer.kind = Kind::kClosed;
  // Bytes or an end that came after the last answer belong to no request.
  if (os::Await(socket_.get(), POLLIN, 0) &&
      recv(socket_.get(), received.data(), received.size(), 0) <= 0) {
    return answer;
  }
  if (send(socket_.get(), request.data(), request.size(), MSG_NOSIGNAL) !=
      static_cast<ssize_t>(request.size())) {
    return answer;
  }
  const auto judge = framing == Framing::kTcp ? modbus::CheckTcpResponse : modbus::CheckRtuResponse;
  using CheckState = modbus::ResponseCheck::State;
  std::size_t size = 0;
  modbus::ResponseCheck check = judge(request, {});
  while (check.state == CheckState::kIncomplete) {
    if (!os::Await(socket_.get(), POLLIN, sent_s + options_.timeout_s)) {
      answer.kind = Kind::kSilent;
      return answer;
    }
    const auto count = recv(socket_.get(), received.data() + size, check.size - size, 0);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) continue;
    if (count <= 0) return answer;
    size += static_cast<std::size_t>(count);
    check = judge(request, Bytes(received).first(size));
  }
  if (check.state == CheckState::kMismatch) {
    answer.kind = Kind::kForeign;
    answer.what = check.found == check.expected
                      ? std::string(check.what)
                      : fmt::format("{} {} instead of {}", check.what, check.found, check.expected);
    return answer;
  }
  answered_ = true;
  if (check.state == CheckState::kException) {
    answer.kind = Kind::kException;
    answer.exception = check.exception;
    return answer;
  }
  answer.kind = Kind::kWords;
  const Bytes data = Bytes(received).subspan(check.data);
  const bool bits = block.table == RegisterTable::kCoil || block.table == RegisterTable::kDiscrete;
  for (std::size_t i = 0; i < static_cast<std::size_t>(block.count); ++i) {
    answer.words.push_back(static_cast<std::uint16_t>(bits ? data[i / 8] >> (i % 8) & 1
                                                           : data[2 * i] << 8 | data[2 * i + 1]));
  }
  return answer;
}

ReadOutcome RegisterClient::Read(int unit, const RegisterBlock& block) {
  ReadOutcome answer;
  if (requests_ >= options_.max_requests) return answer;
  std::array<std::uint8_t, modbus::kMbapBytes + 5> request{};
  for (int attempt = 0; attempt < 2; ++attempt) {
    SleepSeconds(options_.pause_s);
    ++requests_;
    if (!socket_ && !Connect(answer.what)) {
      answer.kind = Kind::kUnreachable;
      return answer;
    }
    modbus::WriteMbap(std::span(request).first<modbus::kMbapBytes>(), ++transaction_,
                      static_cast<std::uint8_t>(unit), 5);
    std::uint8_t* const pdu = request.data() + modbus::kMbapBytes;
    pdu[0] = static_cast<std::uint8_t>(block.table);
    pdu[1] = static_cast<std::uint8_t>(block.first >> 8);
    pdu[2] = static_cast<std::uint8_t>(block.first & 0xFF);
    pdu[3] = static_cast<std::uint8_t>(block.count >> 8);
    pdu[4] = static_cast<std::uint8_t>(block.count & 0xFF);
    const bool had_answered = answered_;
    answer = Exchange(request, Framing::kTcp, block);
    if (answer.kind == Kind::kWords || answer.kind == Kind::kException) break;
    socket_.Reset();  // what comes later must not be taken for the next answer
    answered_ = false;
    if (answer.kind != Kind::kClosed) break;
    if (had_answered) ++closings_;
  }
  return answer;
}

bool RegisterClient::AnswersRtuFrames(int unit) {
  std::string why;
  socket_.Reset();
  ++requests_;
  SleepSeconds(options_.pause_s);
  if (!Connect(why)) return false;
  const std::array<std::uint8_t, 5> pdu{3, 0, 0, 0, 1};
  std::array<std::uint8_t, modbus::kMaxRtuFrameBytes> request{};
  const std::size_t size =
      modbus::WriteRtuFrame(static_cast<std::uint8_t>(unit), pdu, std::span(request));
  const ReadOutcome answer =
      Exchange(Bytes(request).first(size), Framing::kRtu, {RegisterTable::kHolding, 0, 1});
  socket_.Reset();
  return answer.kind == Kind::kWords || answer.kind == Kind::kException;
}

}  // namespace plumbline::robot
