// Detector of conflicting masters: two clients that both write the command window.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "drivers/modbus/client.h"

namespace plumbline::modbus {

/// Two masters are
///   - clients with different addresses that write commands within kConflictWindow_s, or
///   - two connections from one address if the older writes again after the younger has written:
///     a master that reconnects never uses its old connection again.
/// Pure; allocates nothing.
class MasterWatch {
 public:
  static constexpr double kConflictWindow_s = 5;

  /// Records that `writer` has written commands. @return the other master if there are two
  std::optional<Client> RecordWrite(const Client& writer, double now_s);

 private:
  struct Write {
    Client client;
    double time_s = 0;
  };
  static constexpr std::size_t kMaxClients = 8;  ///< remembered, most recent first
  std::array<Write, kMaxClients> writes_;
  std::size_t count_ = 0;
};

}  // namespace plumbline::modbus
