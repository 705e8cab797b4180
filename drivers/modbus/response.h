// Check that bytes are the response to a request of this client, TCP and RTU. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace plumbline::modbus {

/// Verdict on the bytes received so far.
struct ResponseCheck {
  enum class State {
    kIncomplete,  ///< as far as received, the response to the request; `size` bytes are needed next
    kAnswer,      ///< the whole response, and nothing else
    kException,   ///< the whole exception response to the request, with a defined code
    kMismatch,    ///< not the response to this request, however it continues
  };
  State state = State::kIncomplete;
  std::size_t size = 0;   ///< size of the message as far as it is known [bytes]; reading more than
                          ///< this would consume bytes that follow the response
  const char* what = "";  ///< kMismatch: the element that differs
  int found = 0, expected = 0;  ///< kMismatch: its values; equal if a value means nothing
  std::size_t data = 0;         ///< kAnswer to a read: offset of the register or coil bytes
  std::uint8_t exception = 0;   ///< kException: its code
};

/// Compares every element of a response that the request determines: transaction, protocol id,
/// header length, unit, function, byte count or echoed address and value, number of bytes.
/// @param request   whole message sent, function 1..6, 15 or 16; otherwise nothing is an answer
/// @param response  bytes received so far
ResponseCheck CheckTcpResponse(std::span<const std::uint8_t> request,
                               std::span<const std::uint8_t> response);

/// The same on a serial line: unit, function, byte count or echo, number of bytes, CRC. Responses
/// to two reads of one table and count are alike: the caller must keep them apart.
ResponseCheck CheckRtuResponse(std::span<const std::uint8_t> request,
                               std::span<const std::uint8_t> response);

/// Size of the PDU with which a read or write is answered [bytes]; 0: not a known request.
std::size_t AnswerPduSize(std::span<const std::uint8_t> request_pdu);

}  // namespace plumbline::modbus
