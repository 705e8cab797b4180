// Single-threaded Modbus TCP server over libmodbus with many clients and fault injection.
#pragma once

#include <modbus/modbus.h>
#include <sys/select.h>

#include <cstdint>
#include <deque>
#include <vector>

#include "tests/virtual_cell/link_faults.h"
#include "tests/virtual_cell/register_bank.h"

namespace virtual_cell {

class ModbusServer {
 public:
  /// Listens on 127.0.0.1 (or `address`); port 0 lets the kernel choose. Clients may write the
  /// registers first_open..last_open (none if first > last).
  /// @throws std::runtime_error if the port is not available
  ModbusServer(const std::string& address, int port, RegisterBank& bank, int first_open,
               int last_open);
  ~ModbusServer();
  ModbusServer(const ModbusServer&) = delete;
  ModbusServer& operator=(const ModbusServer&) = delete;

  int port() const { return port_; }
  int clients() const { return static_cast<int>(clients_.size()); }

  /// Adds the sockets to wait for; none while stalled.
  void Watch(fd_set& readable, int& highest, double now_s, const LinkFaults& faults) const;
  /// Reads pending requests and sends due answers. Clears one-shot faults.
  void Serve(const fd_set& readable, double now_s, LinkFaults& faults);

 private:
  struct Client {
    int socket;
    bool half_closed;
  };
  struct Pending {
    int socket;
    double due_s;
    std::vector<std::uint8_t> query;
  };

  void Accept();
  bool Take(const Client& client, double now_s, const LinkFaults& faults);
  void Answer(const Pending& pending, const LinkFaults& faults);
  void Close(int socket);
  bool MayWrite(const std::vector<std::uint8_t>& query) const;

  modbus_t* context_ = nullptr;
  modbus_mapping_t mapping_ = {};
  std::vector<std::uint8_t> bits_;
  int first_open_, last_open_;
  int listening_ = -1;
  int port_ = 0;
  std::vector<Client> clients_;
  std::deque<Pending> pending_;
};

}  // namespace virtual_cell
