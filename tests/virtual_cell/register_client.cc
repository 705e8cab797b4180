#include "tests/virtual_cell/register_client.h"

#include <fmt/core.h>

#include <cerrno>
#include <chrono>
#include <stdexcept>
#include <thread>

namespace virtual_cell {

std::vector<std::uint16_t> WordsFromFloats(const std::vector<double>& values) {
  RegisterBank bank(2 * static_cast<int>(values.size()));
  int at = 0;
  for (const double value : values) {
    bank.SetFloat(at, value);
    at += 2;
  }
  return {bank.data(), bank.data() + bank.size()};
}

RegisterClient::RegisterClient(std::string who, const std::string& where, int unit,
                               double patience_s)
    : who_(std::move(who)) {
  const std::size_t colon = where.rfind(':');
  if (colon == std::string::npos) {
    throw std::runtime_error(fmt::format("{}: '{}' is not HOST:PORT", who_, where));
  }
  context_ = modbus_new_tcp_pi(where.substr(0, colon).c_str(), where.substr(colon + 1).c_str());
  if (context_ == nullptr) throw std::runtime_error(fmt::format("{}: '{}'", who_, where));
  modbus_set_slave(context_, unit);
  modbus_set_response_timeout(context_, 2, 0);
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::duration<double>(patience_s);
  while (modbus_connect(context_) != 0) {
    if (std::chrono::steady_clock::now() > give_up) {
      const std::string reason = modbus_strerror(errno);
      modbus_free(context_);
      throw std::runtime_error(fmt::format("{}: no answer at {}: {}", who_, where, reason));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

RegisterClient::~RegisterClient() {
  modbus_close(context_);
  modbus_free(context_);
}

RegisterBank RegisterClient::Read(int first, int count) {
  RegisterBank bank(count);
  if (modbus_read_registers(context_, first, count, bank.data()) != count) {
    Fail(fmt::format("reading {} registers from {}", count, first));
  }
  return bank;
}

std::optional<RegisterBank> RegisterClient::ReadIfThere(int first, int count) {
  RegisterBank bank(count);
  if (modbus_read_registers(context_, first, count, bank.data()) == count) return bank;
  if (errno != EMBXILADD) Fail(fmt::format("reading {} registers from {}", count, first));
  return std::nullopt;
}

void RegisterClient::Write(int first, const std::vector<std::uint16_t>& words) {
  const int count = static_cast<int>(words.size());
  if (modbus_write_registers(context_, first, count, words.data()) != count) {
    Fail(fmt::format("writing {} registers from {}", count, first));
  }
}

void RegisterClient::Fail(const std::string& what) const {
  throw std::runtime_error(fmt::format("{}: {}: {}", who_, what, modbus_strerror(errno)));
}

}  // namespace virtual_cell
