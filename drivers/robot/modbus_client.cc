#include "drivers/robot/modbus_client.h"

#include <fmt/format.h>
#include <modbus/modbus.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <utility>

#include "drivers/os/await.h"
#include "drivers/robot/host_name.h"
#include "drivers/robot/register_client.h"

namespace plumbline::robot {
namespace {

using State = modbus::ResponseCheck::State;

constexpr double kMaxFrame_bits = 256 * 11;
constexpr std::size_t kMinRtuResponseBytes = 5;  // an exception
constexpr int kSynchronisations = 3;             // markers sent before the line is opened again

bool SetConnectTimeout(_modbus* context, double timeout_s) {
  const auto microseconds = static_cast<std::uint32_t>(std::lround(1e6 * timeout_s));
  return modbus_set_response_timeout(context, microseconds / 1000000, microseconds % 1000000) == 0;
}

/// Bytes that are there, without waiting: their number, 0 if there are none; -1 with errno.
ssize_t ReadSome(int fd, std::span<std::uint8_t> buffer) {
  ssize_t count = 0;
  do {
    count = read(fd, buffer.data(), buffer.size());
  } while (count < 0 && errno == EINTR);
  if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return 0;
  if (count == 0) {
    errno = ECONNRESET;
    return -1;
  }
  return count;
}

std::array<std::uint8_t, 5> Pdu(int function, int first, int second) {
  return {static_cast<std::uint8_t>(function), static_cast<std::uint8_t>(first >> 8),
          static_cast<std::uint8_t>(first & 0xFF), static_cast<std::uint8_t>(second >> 8),
          static_cast<std::uint8_t>(second & 0xFF)};
}

LinkResult ResultOfException(int code) {
  if (code >= 1 && code <= 3) return LinkResult::kNoRegisters;
  return code == 10 || code == 11 ? LinkResult::kNoUnit : LinkResult::kException;
}

LinkResult ResultOfErrno(int error) {
  switch (error) {
    case ETIMEDOUT:
      return LinkResult::kTimeout;
    case ECONNREFUSED:
    case EHOSTUNREACH:
    case ENETUNREACH:
      return LinkResult::kRefused;
    case ENOENT:
    case EACCES:
      return LinkResult::kNoDevice;
    default:
      return LinkResult::kLost;
  }
}

std::string TextOf(const modbus::ResponseCheck& mismatch, bool serial) {
  const std::string_view what = mismatch.what;
  const std::string_view remedy =
      what == "unit id" ? "another device answers, or robot.unit_id is wrong"
      : serial ? "a late response, another master or a disturbance; if it recurs, increase "
                 "robot.timeout_ms and check the line"
               : "check that robot.port is that of the controller's Modbus server";
  if (mismatch.found == mismatch.expected)
    return fmt::format("not the response to the request, wrong {}: {}", what, remedy);
  return fmt::format("not the response to the request, {} {} instead of {}: {}", what,
                     mismatch.found, mismatch.expected, remedy);
}

}  // namespace

void ModbusClient::Release::operator()(_modbus* context) const {
  modbus_close(context);
  modbus_free(context);
}

ModbusClient::ModbusClient(_modbus* context, std::string peer, bool serial, Clock clock)
    : context_(context), peer_(std::move(peer)), serial_(serial), clock_(clock) {}

Result<ModbusClient> ModbusClient::Create(_modbus* context, std::string peer, bool serial,
                                          int unit_id, double timeout_s, Clock clock) {
  if (context == nullptr) return Error{fmt::format("{}: {}", peer, modbus_strerror(errno))};
  ModbusClient client(context, std::move(peer), serial, clock);
  if (modbus_set_slave(context, unit_id) != 0) {
    return Error{fmt::format("{}: unit id {} is not 0..247 or 255", client.peer_, unit_id)};
  }
  if (!(timeout_s > 0 && timeout_s < 3600) || !SetConnectTimeout(context, timeout_s)) {
    return Error{fmt::format("{}: timeout {} s is outside 0..3600", client.peer_, timeout_s)};
  }
  client.unit_ = static_cast<std::uint8_t>(unit_id);
  client.configured_timeout_s_ = client.timeout_s_ = timeout_s;
  return client;
}

Result<ModbusClient> ModbusClient::Tcp(const TcpAddress& address, int unit_id, double timeout_s,
                                       Clock clock, std::vector<RegisterBlock> markers) {
  const std::string service = std::to_string(address.port);
  Result<ModbusClient> client =
      Create(modbus_new_tcp_pi(address.host.c_str(), service.c_str()),
             fmt::format("{}:{}", address.host, address.port), false, unit_id, timeout_s, clock);
  if (!client) return client;
  ModbusClient named = std::move(client).value();
  named.host_ = address.host;
  named.markers_ = std::move(markers);
  return named;
}

Result<ModbusClient> ModbusClient::Rtu(const SerialLine& line, int unit_id, double timeout_s,
                                       Clock clock, std::vector<RegisterBlock> markers) {
  if (line.baud <= 0)
    return Error{fmt::format("{}: {} baud is not positive", line.device, line.baud)};
  if (markers.empty()) return Error{fmt::format("{}: no read can synchronise it", line.device)};
  const double frame_s = kMaxFrame_bits / line.baud;
  Result<ModbusClient> client =
      Create(modbus_new_rtu(line.device.c_str(), line.baud, line.parity, 8, line.stop_bits),
             line.device, true, unit_id, timeout_s + frame_s, clock);
  if (!client) return client;
  ModbusClient marked = std::move(client).value();
  marked.longest_frame_s_ = frame_s;
  marked.markers_ = std::move(markers);
  return marked;
}

LinkResult ModbusClient::Connect() {
  if (connected_) return serial_ && !synchronised_ ? Synchronise() : LinkResult::kOk;
  if (clock_() < next_attempt_s_) return LinkResult::kWaiting;
  errno = 0;
  if (modbus_connect(context_.get()) != 0) {
    // For a name that cannot be resolved libmodbus reports ECONNREFUSED or no error.
    const int error = errno;
    if (!serial_ && (error == 0 || error == ECONNREFUSED)) {
      if (const char* why = ResolveFailure(host_)) return FailUnresolved(why);
    }
    request_size_ = 0;
    return FailWith(error == 0 ? EHOSTUNREACH : error);
  }
  connected_ = true;
  ++connections_;
  synchronised_ = false;
  request_size_ = 0;
  return serial_ ? Synchronise() : LinkResult::kOk;
}

const RegisterBlock& ModbusClient::NextMarker() {
  marker_ = (marker_ + 1) % markers_.size();
  return markers_[marker_];
}

/// Discards what is received until nothing was received for longest_frame_s_.
/// @param was_silent  set to false if anything was
LinkResult ModbusClient::AwaitSilence(bool& was_silent) {
  const int fd = modbus_get_socket(context_.get());
  const double give_up_s = MonotonicSeconds() + timeout_s_ + 2 * longest_frame_s_;
  for (was_silent = true; os::Await(fd, POLLIN, MonotonicSeconds() + longest_frame_s_);) {
    was_silent = false;
    if (ReadSome(fd, response_) < 0) return FailWith(errno);
    if (MonotonicSeconds() > give_up_s) {
      return Fail(LinkResult::kProtocol,
                  "the line is never silent: another master, or a disturbance");
    }
  }
  return LinkResult::kOk;
}

/// A late response makes the marker's answer a mismatch, or follows it: then again.
LinkResult ModbusClient::Synchronise() {
  bool silent = false;
  LinkResult result = AwaitSilence(silent);
  for (int attempt = 1; result == LinkResult::kOk; ++attempt) {
    const RegisterBlock& marker = NextMarker();
    result = Send(Pdu(static_cast<int>(marker.table), marker.first, marker.count));
    modbus::ResponseCheck check;
    if (result == LinkResult::kOk) result = Receive(MonotonicSeconds() + timeout_s_, check);
    if (result == LinkResult::kOk) result = AwaitSilence(silent);
    if (result != LinkResult::kOk) break;
    if (check.state == State::kAnswer && silent) {
      synchronised_ = true;
      break;
    }
    if (check.state == State::kException) {
      return Fail(
          ResultOfException(check.exception),
          fmt::format("exception 0x{:02X}: the controller refuses to read a part of a block, "
                      "without which late responses cannot be recognised",
                      check.exception));
    }
    if (attempt == kSynchronisations) {
      return Fail(LinkResult::kProtocol, check.state == State::kAnswer
                                             ? "late responses: increase robot.timeout_ms"
                                             : TextOf(check, true));
    }
  }
  return result;
}

LinkResult ModbusClient::DiscardUnread() {
  const int fd = modbus_get_socket(context_.get());
  std::size_t unread = 0;
  while (os::Await(fd, POLLIN, 0)) {
    const auto count = ReadSome(fd, response_);
    if (count < 0) return FailWith(errno);
    unread += static_cast<std::size_t>(count);
    // A disturbance when the transmitters change; anything longer may have been a response.
    if (!serial_ || unread >= kMinRtuResponseBytes) {
      return Fail(LinkResult::kProtocol,
                  "bytes that no request has asked for: does another program use the line, or "
                  "does the controller answer twice?");
    }
  }
  return LinkResult::kOk;
}

LinkResult ModbusClient::Send(Bytes pdu) {
  if (serial_) {
    request_size_ =
        modbus::WriteRtuFrame(unit_, pdu, std::span(request_).first<modbus::kMaxRtuFrameBytes>());
  } else {
    modbus::WriteMbap(std::span(request_).first<modbus::kMbapBytes>(), ++transaction_, unit_,
                      pdu.size());
    std::copy(pdu.begin(), pdu.end(), request_.begin() + modbus::kMbapBytes);
    request_size_ = modbus::kMbapBytes + pdu.size();
  }
  if (const LinkResult unread = DiscardUnread(); unread != LinkResult::kOk) return unread;
  const int fd = modbus_get_socket(context_.get());
  const auto sent = serial_ ? write(fd, request_.data(), request_size_)
                            : send(fd, request_.data(), request_size_, MSG_NOSIGNAL);
  if (sent == static_cast<ssize_t>(request_size_)) return LinkResult::kOk;
  return FailWith(sent < 0 ? errno : ETIMEDOUT);
}

/// kOk once the bytes have been judged, also if they are not the response.
LinkResult ModbusClient::Receive(double until_s, modbus::ResponseCheck& check) {
  const int fd = modbus_get_socket(context_.get());
  const auto judge = serial_ ? modbus::CheckRtuResponse : modbus::CheckTcpResponse;
  const Bytes request = Bytes(request_).first(request_size_);
  response_size_ = 0;
  for (check = judge(request, {}); check.state == State::kIncomplete;) {
    if (!os::Await(fd, POLLIN, until_s)) return FailWith(ETIMEDOUT);
    const auto count =
        ReadSome(fd, std::span(response_).subspan(response_size_, check.size - response_size_));
    if (count < 0) return FailWith(errno);
    response_size_ += static_cast<std::size_t>(count);
    check = judge(request, Bytes(response_).first(response_size_));
  }
  return LinkResult::kOk;
}

LinkResult ModbusClient::Exchange(Bytes pdu, Bytes* data) {
  LinkResult result = serial_ && !synchronised_ ? Synchronise() : LinkResult::kOk;
  if (result == LinkResult::kOk) result = Send(pdu);
  if (result != LinkResult::kOk) return result;
  modbus::ResponseCheck check;
  result = Receive(MonotonicSeconds() + timeout_s_, check);
  if (result != LinkResult::kOk) return result;
  if (check.state == State::kMismatch) return Fail(LinkResult::kProtocol, TextOf(check, serial_));
  if (check.state == State::kException) {
    return Fail(
        ResultOfException(check.exception),
        fmt::format("exception 0x{:02X} ({})", check.exception, ExceptionText(check.exception)));
  }
  if (data != nullptr) *data = Bytes(response_).subspan(check.data);
  return LinkResult::kOk;
}

LinkResult ModbusClient::Read(const RegisterBlock& block, std::span<std::uint16_t> words) {
  Bytes data;
  const LinkResult result =
      Exchange(Pdu(static_cast<int>(block.table), block.first, block.count), &data);
  if (result != LinkResult::kOk) return result;
  const bool bits = block.table == RegisterTable::kCoil || block.table == RegisterTable::kDiscrete;
  for (std::size_t i = 0; i < static_cast<std::size_t>(block.count); ++i) {
    words[i] = static_cast<std::uint16_t>(bits ? data[i / 8] >> (i % 8) & 1
                                               : data[2 * i] << 8 | data[2 * i + 1]);
  }
  return LinkResult::kOk;
}

LinkResult ModbusClient::Write(int first, std::span<const std::uint16_t> words) {
  std::array<std::uint8_t, 6 + 2 * kMaxRegistersOfWrite> pdu{};
  const std::size_t bytes = 2 * words.size();
  const auto head = Pdu(16, first, static_cast<int>(words.size()));
  std::copy(head.begin(), head.end(), pdu.begin());
  pdu[head.size()] = static_cast<std::uint8_t>(bytes);
  for (std::size_t i = 0; i < words.size(); ++i) {
    pdu[6 + 2 * i] = static_cast<std::uint8_t>(words[i] >> 8);
    pdu[7 + 2 * i] = static_cast<std::uint8_t>(words[i] & 0xFF);
  }
  return Exchange(Bytes(pdu).first(6 + bytes));
}

LinkResult ModbusClient::WriteOne(int address, std::uint16_t word) {
  return Exchange(Pdu(6, address, word));
}

void ModbusClient::LimitTimeout(double max_s) {
  timeout_s_ = std::clamp(max_s, 1e-3, configured_timeout_s_);
}

LinkResult ModbusClient::FailWith(int error) {
  return Fail(ResultOfErrno(error), modbus_strerror(error));
}

LinkResult ModbusClient::Fail(LinkResult result, std::string_view what) {
  const auto room = problem_.size();
  const std::size_t pdu = serial_ ? 1 : modbus::kMbapBytes;
  const auto word = [this, pdu](std::size_t at) {
    return request_[pdu + at] << 8 | request_[pdu + at + 1];
  };
  const auto written =
      connected_ && request_size_ > pdu + 4
          ? fmt::format_to_n(problem_.begin(), room, "{}: FC{:02}, {} from {}: {}", peer_,
                             request_[pdu], request_[pdu] == 6 ? 1 : word(3), word(1), what)
          : fmt::format_to_n(problem_.begin(), room, "{}: connecting: {}", peer_, what);
  problem_size_ = std::min(written.size, room);
  synchronised_ = false;
  if (!IsException(result)) Close();
  return result;
}

LinkResult ModbusClient::FailUnresolved(const char* why) {
  const auto written = fmt::format_to_n(
      problem_.begin(), problem_.size(),
      "{}: the name is not known ({}); check robot.host, or give the address", peer_, why);
  problem_size_ = std::min(written.size, problem_.size());
  Close();
  return LinkResult::kUnknownName;
}

void ModbusClient::Close() {
  modbus_close(context_.get());
  connected_ = false;
  next_attempt_s_ = clock_() + wait_s_;
  wait_s_ = std::min(2 * wait_s_, kMaxWait_s);
}

}  // namespace plumbline::robot
