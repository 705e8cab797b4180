// Detector of two masters: clients that write the command window against each other.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "drivers/modbus/client.h"

namespace plumbline::modbus {

/// Two masters are
///   - clients of different addresses that write commands within kTogether_s of each other, or
///   - connections of one address of which the older writes again after the younger one has: both
///     are alive. A master that reconnects never writes by the old connection again.
/// Values in, verdict out; allocates nothing.
class MasterWatch {
 public:
  static constexpr double kTogether_s = 5;

  /// A client has written commands. @return the other master, where there are two
  std::optional<Client> Note(const Client& writer, double now_s);

 private:
  struct Write {
    Client client;
    double time_s = 0;
  };
  static constexpr std::size_t kMostClients = 8;  ///< that are remembered, the newest first
  std::array<Write, kMostClients> writes_;
  std::size_t count_ = 0;
};

}  // namespace plumbline::modbus
