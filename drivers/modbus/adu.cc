#include "drivers/modbus/adu.h"

#include <algorithm>
#include <cstring>

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

namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::array<std::uint16_t, 256> MakeCrcTable() {
  std::array<std::uint16_t, 256> table{};
  for (unsigned byte = 0; byte < 256; ++byte) {
    unsigned crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? (crc >> 1) ^ 0xA001U : crc >> 1;
    table[byte] = static_cast<std::uint16_t>(crc);
  }
  return table;
}
constexpr auto kCrcTable = MakeCrcTable();

constexpr std::size_t kRtuOverheadBytes = 3;  // address and CRC
constexpr std::size_t kMinRtuFrameBytes = 4;

/// Length of a request frame [bytes] from its function code; 0: unknown, or more bytes needed.
std::size_t RequestLength(Bytes frame) {
  switch (frame[1]) {
    case 1:
    case 2:
    case 3:
    case 4:
    case 5:
    case 6:
      return 8;
    case 15:
    case 16:
      return frame.size() > 6 ? 9U + frame[6] : 0;
    case 22:
      return 10;
    case 23:
      return frame.size() > 10 ? 13U + frame[10] : 0;
    case 43:
      return 7;
    default:
      return 0;
  }
}

/// Length of a reply frame [bytes] from its function code; 0: unknown.
std::size_t ReplyLength(Bytes frame) {
  if ((frame[1] & 0x80) != 0) return 5;
  switch (frame[1]) {
    case 1:
    case 2:
    case 3:
    case 4:
    case 23:
      return 5U + frame[2];
    case 5:
    case 6:
    case 15:
    case 16:
      return 8;
    case 22:
      return 10;
    default:
      return 0;
  }
}

/// True if `rest` starts with a valid frame of `length` bytes: the CRC over a frame including its
/// CRC is zero.
bool IsFrame(Bytes rest, std::size_t length) {
  return length >= kMinRtuFrameBytes && length <= std::min(rest.size(), kMaxRtuFrameBytes) &&
         Crc16(rest.first(length)) == 0;
}

}  // namespace

TcpFrame ParseTcpFrame(Bytes stream) {
  TcpFrame frame;
  if (stream.size() >= 4 && (stream[2] != 0 || stream[3] != 0)) {
    frame.state = TcpFrame::State::kBroken;
    return frame;
  }
  if (stream.size() < 6) return frame;
  const std::size_t length = static_cast<std::size_t>((stream[4] << 8) | stream[5]);
  if (length < 2 || length > kMaxPduBytes + 1) {
    frame.state = TcpFrame::State::kBroken;
    return frame;
  }
  if (stream.size() < 6 + length) return frame;
  frame.state = TcpFrame::State::kComplete;
  frame.transaction = static_cast<std::uint16_t>((stream[0] << 8) | stream[1]);
  frame.unit = stream[6];
  frame.size = 6 + length;
  frame.pdu = stream.subspan(kMbapBytes, length - 1);
  return frame;
}

void WriteMbap(std::span<std::uint8_t, kMbapBytes> header, std::uint16_t transaction,
               std::uint8_t unit, std::size_t pdu_size) {
  const std::size_t length = pdu_size + 1;
  header[0] = static_cast<std::uint8_t>(transaction >> 8);
  header[1] = static_cast<std::uint8_t>(transaction & 0xFF);
  header[2] = 0;
  header[3] = 0;
  header[4] = static_cast<std::uint8_t>(length >> 8);
  header[5] = static_cast<std::uint8_t>(length & 0xFF);
  header[6] = unit;
}

std::uint16_t Crc16(Bytes bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) crc = (crc >> 8) ^ kCrcTable[(crc ^ byte) & 0xFF];
  return static_cast<std::uint16_t>(crc);
}

double RtuSilence_s(int baud) {
  return baud > 19200 ? 0.00175 : 3.5 * 11 / baud;
}

std::size_t WriteRtuFrame(std::uint8_t address, Bytes pdu,
                          std::span<std::uint8_t, kMaxRtuFrameBytes> frame) {
  const std::size_t body = 1 + pdu.size();
  frame[0] = address;
  std::copy(pdu.begin(), pdu.end(), frame.begin() + 1);
  const std::uint16_t crc = Crc16(frame.first(body));
  frame[body] = static_cast<std::uint8_t>(crc & 0xFF);
  frame[body + 1] = static_cast<std::uint8_t>(crc >> 8);
  return body + 2;
}

void RtuReceiver::Push(Bytes bytes) {
  if (begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  if (bytes.size() > buffer_.size() - end_) overflow_ = true;
  if (overflow_) return;
  std::copy(bytes.begin(), bytes.end(), buffer_.begin() + static_cast<std::ptrdiff_t>(end_));
  end_ += bytes.size();
}

std::optional<RtuFrame> RtuReceiver::Next() {
  while (!overflow_ && end_ - begin_ >= kMinRtuFrameBytes) {
    const Bytes rest(buffer_.data() + begin_, end_ - begin_);
    const std::size_t length = FrameLength(rest);
    if (length == 0) return std::nullopt;
    begin_ += length;
    if (rest[0] == unit_ || rest[0] == kBroadcastAddress) {
      return RtuFrame{.address = rest[0],
                      .pdu = rest.subspan(1, length - kRtuOverheadBytes),
                      .newest = begin_ == end_};
    }
  }
  return std::nullopt;
}

void RtuReceiver::Clear() {
  begin_ = end_ = 0;
  overflow_ = false;
}

/// Length of the frame at the start of `rest` [bytes]; 0 if none is complete.
std::size_t RtuReceiver::FrameLength(Bytes rest) const {
  const std::size_t request = RequestLength(rest);
  if (IsFrame(rest, request)) return request;
  const bool may_be_reply = rest[0] != unit_ && rest[0] != kBroadcastAddress;
  const std::size_t reply = may_be_reply ? ReplyLength(rest) : 0;
  if (IsFrame(rest, reply)) return reply;
  return IsFrame(rest, rest.size()) ? rest.size() : 0;
}

}  // namespace plumbline::modbus
