#include "drivers/robot/modbus_client.h"

#include <fmt/format.h>
#include <modbus/modbus.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <utility>

#include "drivers/robot/host_name.h"

namespace plumbline::robot {
namespace {

constexpr double kMaxFrame_bits = 256 * 11;

bool IsException(int error) {
  return error >= EMBXILFUN && error <= EMBXGTAR;
}

LinkResult ResultFromErrno(int error) {
  if (IsException(error)) return LinkResult::kException;
  if (error == ETIMEDOUT) return LinkResult::kTimeout;
  if (error >= MODBUS_ENOBASE) return LinkResult::kProtocol;
  return LinkResult::kLost;
}

bool SetTimeout(_modbus* context, double timeout_s) {
  const auto microseconds = static_cast<std::uint32_t>(std::lround(1e6 * timeout_s));
  return modbus_set_response_timeout(context, microseconds / 1000000, microseconds % 1000000) == 0;
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
  if (!(timeout_s > 0 && timeout_s < 3600) || !SetTimeout(context, timeout_s)) {
    return Error{fmt::format("{}: timeout {} s is outside 0..3600", client.peer_, timeout_s)};
  }
  client.timeout_s_ = timeout_s;
  // Without a byte timeout the response timeout covers the whole response.
  modbus_set_byte_timeout(context, 0, 0);
  return client;
}

Result<ModbusClient> ModbusClient::Tcp(const TcpAddress& address, int unit_id, double timeout_s,
                                       Clock clock) {
  const std::string service = std::to_string(address.port);
  Result<ModbusClient> client =
      Create(modbus_new_tcp_pi(address.host.c_str(), service.c_str()),
             fmt::format("{}:{}", address.host, address.port), false, unit_id, timeout_s, clock);
  if (!client) return client;
  ModbusClient named = std::move(client).value();
  named.host_ = address.host;
  return named;
}

Result<ModbusClient> ModbusClient::Rtu(const SerialLine& line, int unit_id, double timeout_s,
                                       Clock clock) {
  if (line.baud <= 0)
    return Error{fmt::format("{}: {} baud is not positive", line.device, line.baud)};
  const double frame_s = kMaxFrame_bits / line.baud;
  return Create(modbus_new_rtu(line.device.c_str(), line.baud, line.parity, 8, line.stop_bits),
                line.device, true, unit_id, timeout_s + frame_s, clock);
}

LinkResult ModbusClient::Connect() {
  if (connected_) return LinkResult::kOk;
  if (clock_() < next_attempt_s_) return LinkResult::kWaiting;
  errno = 0;
  if (modbus_connect(context_.get()) != 0) {
    // For a name that cannot be resolved libmodbus reports ECONNREFUSED or no error.
    const int error = errno;
    if (!serial_ && (error == 0 || error == ECONNREFUSED)) {
      if (const char* why = ResolveFailure(host_)) return FailUnresolved(why);
    }
    errno = error == 0 ? EHOSTUNREACH : error;
    return Fail(0, 0, 0);
  }
  connected_ = true;
  ++connections_;
  return LinkResult::kOk;
}

bool ModbusClient::ReadyForRequest() {
  if (serial_) {
    modbus_flush(context_.get());
    return true;
  }
  char byte = 0;
  const auto waiting = recv(modbus_get_socket(context_.get()), &byte, 1, MSG_PEEK | MSG_DONTWAIT);
  if (waiting < 0) return errno == EAGAIN || errno == EWOULDBLOCK;
  errno = waiting == 0 ? ECONNRESET : EMBBADDATA;
  return false;
}

LinkResult ModbusClient::Read(const RegisterBlock& block, std::span<std::uint16_t> words) {
  int count = -1;
  if (!ReadyForRequest()) {
    // errno is set
  } else if (block.table == RegisterTable::kHolding) {
    count = modbus_read_registers(context_.get(), block.first, block.count, words.data());
  } else if (block.table == RegisterTable::kInput) {
    count = modbus_read_input_registers(context_.get(), block.first, block.count, words.data());
  } else {
    std::array<std::uint8_t, kMaxRegistersOfRead> bits{};
    count = block.table == RegisterTable::kCoil
                ? modbus_read_bits(context_.get(), block.first, block.count, bits.data())
                : modbus_read_input_bits(context_.get(), block.first, block.count, bits.data());
    std::copy_n(bits.begin(), block.count, words.begin());
  }
  if (count == block.count) return LinkResult::kOk;
  return Fail(static_cast<int>(block.table), block.first, block.count);
}

LinkResult ModbusClient::Write(int first, std::span<const std::uint16_t> words) {
  const int count = static_cast<int>(words.size());
  if (ReadyForRequest() &&
      modbus_write_registers(context_.get(), first, count, words.data()) == count) {
    return LinkResult::kOk;
  }
  return Fail(16, first, count);
}

LinkResult ModbusClient::WriteOne(int address, std::uint16_t word) {
  if (ReadyForRequest() && modbus_write_register(context_.get(), address, word) == 1) {
    return LinkResult::kOk;
  }
  return Fail(6, address, 1);
}

void ModbusClient::LimitTimeout(double max_s) {
  SetTimeout(context_.get(), std::clamp(max_s, 1e-3, timeout_s_));
}

LinkResult ModbusClient::Fail(int function, int first, int count) {
  const int error = errno;
  const auto room = problem_.size();
  const auto written =
      function == 0 ? fmt::format_to_n(problem_.begin(), room, "{}: connecting: {}", peer_,
                                       modbus_strerror(error))
                    : fmt::format_to_n(problem_.begin(), room, "{}: FC{:02}, {} from {}: {}", peer_,
                                       function, count, first, modbus_strerror(error));
  problem_size_ = std::min(written.size, room);
  const LinkResult result = ResultFromErrno(error);
  if (result != LinkResult::kException) Close();
  return result;
}

LinkResult ModbusClient::FailUnresolved(const char* why) {
  const auto written = fmt::format_to_n(
      problem_.begin(), problem_.size(),
      "{}: the name is not known ({}); check robot.host, or give the address", peer_, why);
  problem_size_ = std::min(written.size, problem_.size());
  Close();
  return LinkResult::kLost;
}

void ModbusClient::Close() {
  modbus_close(context_.get());
  connected_ = false;
  next_attempt_s_ = clock_() + wait_s_;
  wait_s_ = std::min(2 * wait_s_, kMaxWait_s);
}

}  // namespace plumbline::robot
