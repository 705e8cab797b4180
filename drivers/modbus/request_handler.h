// What stands between a transport (TCP, serial line) and the registers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/modbus/client.h"

namespace plumbline::modbus {

/// Function code and data, without address, transaction or check sum. [Modbus V1.1b3, 4.1]
inline constexpr std::size_t kMaxPduBytes = 253;

/// Answers one request. Called in the thread of a transport; must not block, allocate or throw.
class RequestHandler {
 public:
  virtual ~RequestHandler() = default;

  /// @param client    who asks
  /// @param request   the request's PDU, at least one byte
  /// @param response  where the answer's PDU goes
  /// @return          bytes of the answer; 0: stay silent
  virtual std::size_t Handle(const Client& client, std::span<const std::uint8_t> request,
                             std::span<std::uint8_t, kMaxPduBytes> response) = 0;
};

}  // namespace plumbline::modbus
