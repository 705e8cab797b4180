// Modbus protocol data unit: decodes one request and encodes its response. No socket, clock or
// heap.
//
// FC 1-6, 15, 16, 22, 23 and 43/14 as in "MODBUS Application Protocol Specification V1.1b3".
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/modbus/register_image.h"
#include "drivers/modbus/request_handler.h"

namespace plumbline::modbus {

enum class Exception : std::uint8_t {
  kNone = 0,
  kIllegalFunction = 1,
  kIllegalAddress = 2,  ///< in a gap, beyond the end, or a write outside the command area
  kIllegalValue = 3,    ///< bad count or value, or a length that contradicts the count
  kServerFailure = 4,   ///< the image is smaller than its readable addresses
  kGatewayTargetFailed = 0x0B,
};

/// Objects returned by FC 43/14. Ids 0-2 (vendor, product code, revision) are mandatory, 3-6
/// regular, 0x80-0xFF vendor-specific. In ascending order; values longer than 244 bytes are cut.
struct DeviceIdentification {
  struct Object {
    std::uint8_t id = 0;
    std::string value;
  };
  std::vector<Object> objects;
};

/// Size of the response, and what the request wrote into the command area.
struct PduReply {
  enum class Wrote { kNothing, kRegisters, kCoils };
  std::size_t size = 0;
  Wrote wrote = Wrote::kNothing;
  std::uint16_t first = 0, count = 0;  ///< the written addresses
};

/// Answers one request from one image. A refused request changes nothing. FC23 writes before it
/// reads.
/// @param request  PDU; an empty one gets no response (size 0)
PduReply HandlePdu(std::span<const std::uint8_t> request, const RegisterImage& image,
                   CommandArea& commands, const DeviceIdentification& identification,
                   std::span<std::uint8_t, kMaxPduBytes> response);

/// Writes an exception response to `function`. @return its size, 2 bytes
std::size_t WriteException(std::uint8_t function, Exception exception,
                           std::span<std::uint8_t, kMaxPduBytes> response);

}  // namespace plumbline::modbus
