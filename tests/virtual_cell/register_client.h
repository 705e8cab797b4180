// Modbus TCP client of a PLC: reads and writes blocks of holding registers.
#pragma once

#include <modbus/modbus.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tests/virtual_cell/register_bank.h"

namespace virtual_cell {

/// Words of a float32, high word first.
std::vector<std::uint16_t> WordsFromFloats(const std::vector<double>& values);

class RegisterClient {
 public:
  /// @param where "HOST:PORT"; connection attempts continue for `patience_s`
  /// @throws std::runtime_error naming `who` if the connection fails
  RegisterClient(std::string who, const std::string& where, int unit, double patience_s);
  ~RegisterClient();
  RegisterClient(const RegisterClient&) = delete;
  RegisterClient& operator=(const RegisterClient&) = delete;

  /// `count` registers from `first` on, at offset 0 of the bank.
  /// @throws std::runtime_error with `who`, the operation and the reason
  RegisterBank Read(int first, int count);
  /// The same; nullopt if the server does not have these registers (exception 02).
  std::optional<RegisterBank> ReadIfThere(int first, int count);
  void Write(int first, const std::vector<std::uint16_t>& words);

 private:
  [[noreturn]] void Fail(const std::string& what) const;

  std::string who_;
  modbus_t* context_ = nullptr;
};

}  // namespace virtual_cell
