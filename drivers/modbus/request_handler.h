// Interface between a transport (TCP, serial line) and the registers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/modbus/client.h"

namespace plumbline::modbus {

/// Function code and data, without address, transaction id or checksum. [Modbus V1.1b3, 4.1]
inline constexpr std::size_t kMaxPduBytes = 253;

/// Handles requests. Called in the thread of a transport; must not block, allocate or throw.
class RequestHandler {
 public:
  virtual ~RequestHandler() = default;

  /// @param client    sender of the request
  /// @param request   PDU of the request, at least one byte
  /// @param response  receives the PDU of the response
  /// @return          size of the response [bytes]; 0 if none is to be sent
  virtual std::size_t Handle(const Client& client, std::span<const std::uint8_t> request,
                             std::span<std::uint8_t, kMaxPduBytes> response) = 0;
};

}  // namespace plumbline::modbus
