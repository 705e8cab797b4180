#include "drivers/modbus/adu.h"

#include <algorithm>
#include <cstring>

namespace plumbline::modbus {
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
