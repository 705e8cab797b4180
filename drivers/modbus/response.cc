#include "drivers/modbus/response.h"

#include <algorithm>

#include "drivers/modbus/adu.h"

namespace plumbline::modbus {
namespace {

using Bytes = std::span<const std::uint8_t>;
using State = ResponseCheck::State;

constexpr std::uint8_t kExceptionFlag = 0x80;
constexpr std::size_t kExceptionPduBytes = 2;
constexpr std::size_t kEchoBytes = 5;  // function, address, value or count
constexpr std::size_t kCrcBytes = 2;

int WordAt(Bytes bytes, std::size_t at) {
  return bytes[at] << 8 | bytes[at + 1];
}

bool IsRead(std::uint8_t function) {
  return function >= 1 && function <= 4;
}

/// Codes of the Modbus Application Protocol V1.1b3, 7.
bool IsExceptionCode(std::uint8_t code) {
  return (code >= 1 && code <= 8) || code == 10 || code == 11;
}

ResponseCheck Mismatch(const char* what, int found = 0, int expected = 0) {
  return {.state = State::kMismatch, .what = what, .found = found, .expected = expected};
}

/// kIncomplete with the size of the PDU, or a mismatch. With all bytes of the PDU present, it is
/// the answer, or the exception response, to the request.
ResponseCheck CheckPdu(Bytes request, Bytes response) {
  const std::size_t answer_size = AnswerPduSize(request);
  if (answer_size == 0) return Mismatch("a request without a known answer");
  if (response.empty()) return {.size = std::min(answer_size, kExceptionPduBytes)};
  const std::uint8_t function = request[0];
  if (response[0] == (function | kExceptionFlag)) {
    if (response.size() < kExceptionPduBytes) return {.size = kExceptionPduBytes};
    if (!IsExceptionCode(response[1])) return Mismatch("undefined exception code", response[1]);
    return {.size = kExceptionPduBytes, .exception = response[1]};
  }
  if (response[0] != function) return Mismatch("function code", response[0], function);
  if (IsRead(function)) {
    const auto bytes = static_cast<int>(answer_size - 2);
    if (response.size() > 1 && response[1] != bytes) {
      return Mismatch("byte count", response[1], bytes);
    }
    return {.size = answer_size, .data = 2};
  }
  for (std::size_t i = 1; i < std::min(response.size(), kEchoBytes); ++i) {
    if (response[i] != request[i]) {
      return Mismatch(i < 3 ? "written address" : "written value or count", response[i],
                      request[i]);
    }
  }
  return {.size = answer_size};
}

/// Adds header and trailer to the verdict on the PDU.
ResponseCheck Framed(ResponseCheck check, std::size_t header, std::size_t trailer,
                     std::size_t received) {
  if (check.state == State::kMismatch) return check;
  check.size += header + trailer;
  check.data += header;
  if (received < check.size) return check;
  if (received > check.size) {
    return Mismatch("number of bytes", static_cast<int>(received), static_cast<int>(check.size));
  }
  check.state = check.exception != 0 ? State::kException : State::kAnswer;
  return check;
}

Bytes From(Bytes bytes, std::size_t at) {
  return bytes.subspan(std::min(at, bytes.size()));
}

}  // namespace

std::size_t AnswerPduSize(Bytes request) {
  if (request.size() < kEchoBytes) return 0;
  const int count = WordAt(request, 3);
  switch (request[0]) {
    case 1:
    case 2:
      return count >= 1 && count <= 2000 ? 2 + static_cast<std::size_t>((count + 7) / 8) : 0;
    case 3:
    case 4:
      return count >= 1 && count <= 125 ? 2 + 2 * static_cast<std::size_t>(count) : 0;
    case 5:
    case 6:
    case 15:
    case 16:
      return kEchoBytes;
    default:
      return 0;
  }
}

ResponseCheck CheckTcpResponse(Bytes request, Bytes response) {
  if (request.size() < kMinTcpFrameBytes) return Mismatch("a request without a known answer");
  constexpr const char* kHeader[] = {"transaction id", "protocol id"};
  for (std::size_t at = 0; at < 4; at += 2) {
    if (response.size() < at + 2) break;
    const int found = WordAt(response, at), expected = WordAt(request, at);
    if (found != expected) return Mismatch(kHeader[at / 2], found, expected);
  }
  if (response.size() >= kMbapBytes && response[6] != request[6]) {
    return Mismatch("unit id", response[6], request[6]);
  }
  const ResponseCheck pdu = CheckPdu(From(request, kMbapBytes), From(response, kMbapBytes));
  if (pdu.state != State::kMismatch && response.size() > kMbapBytes) {
    const int length = WordAt(response, 4), expected = static_cast<int>(pdu.size) + 1;
    if (length != expected) return Mismatch("length in the header", length, expected);
  }
  return Framed(pdu, kMbapBytes, 0, response.size());
}

ResponseCheck CheckRtuResponse(Bytes request, Bytes response) {
  if (request.size() < 1 + kEchoBytes + kCrcBytes) {
    return Mismatch("a request without a known answer");
  }
  if (!response.empty() && response[0] != request[0]) {
    return Mismatch("unit id", response[0], request[0]);
  }
  const ResponseCheck pdu = CheckPdu(From(request, 1), From(response, 1));
  const ResponseCheck check = Framed(pdu, 1, kCrcBytes, response.size());
  const bool whole = check.state == State::kAnswer || check.state == State::kException;
  if (whole && Crc16(response) != 0) return Mismatch("checksum");
  return check;
}

}  // namespace plumbline::modbus
