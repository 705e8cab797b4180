#include "drivers/zoom/visca_codec.h"

#include <algorithm>

namespace plumbline::visca {
namespace {

constexpr std::uint8_t kEnd = 0xFF, kToAll = 0x88;

// Types of datagrams, and contents of the control messages.
constexpr unsigned kInquiry = 0x0110, kReply = 0x0111, kControl = 0x0200, kControlReply = 0x0201;
constexpr std::uint8_t kResetSequence = 0x01, kAbnormal = 0x0F, kAbnormalSequence = 0x01;

Request RequestOf(std::initializer_list<std::uint8_t> bytes) {
  Request request;
  std::copy(bytes.begin(), bytes.end(), request.bytes.begin());
  request.size = bytes.size();
  return request;
}

std::uint8_t HeaderTo(int address) {
  return static_cast<std::uint8_t>(0x80 | (address & 0x07));
}

/// 0p 0q 0r 0s -> pqrs.
std::optional<std::int32_t> FourNibbles(const std::uint8_t* bytes) {
  std::int32_t value = 0;
  for (int i = 0; i < 4; ++i) {
    if ((bytes[i] & 0xF0) != 0) return std::nullopt;
    value = value << 4 | bytes[i];
  }
  return value;
}

Datagram DatagramOf(unsigned type, std::span<const std::uint8_t> content, std::uint32_t sequence) {
  Datagram datagram;
  const std::array<std::uint8_t, kHeaderBytes> header = {
      static_cast<std::uint8_t>(type >> 8),
      static_cast<std::uint8_t>(type & 0xFF),
      0,
      static_cast<std::uint8_t>(content.size()),
      static_cast<std::uint8_t>(sequence >> 24),
      static_cast<std::uint8_t>(sequence >> 16 & 0xFF),
      static_cast<std::uint8_t>(sequence >> 8 & 0xFF),
      static_cast<std::uint8_t>(sequence & 0xFF)};
  std::copy(content.begin(), content.end(),
            std::copy(header.begin(), header.end(), datagram.bytes.begin()));
  datagram.size = header.size() + content.size();
  return datagram;
}

/// True if the bytes are a single packet from a camera.
bool IsPacket(std::span<const std::uint8_t> bytes) {
  return std::find(bytes.begin(), bytes.end(), kEnd) == bytes.end() - 1 &&
         ReplyFromPacket(bytes).kind != Reply::Kind::kMalformed;
}

}  // namespace

Request AddressSet() {
  return RequestOf({kToAll, 0x30, 0x01, kEnd});
}

Request ZoomPosition(int address) {
  return RequestOf({HeaderTo(address), 0x09, 0x04, 0x47, kEnd});
}

Request FocusPosition(int address) {
  return RequestOf({HeaderTo(address), 0x09, 0x04, 0x48, kEnd});
}

Request LensBlock(int address) {
  return RequestOf({HeaderTo(address), 0x09, 0x7E, 0x7E, 0x00, kEnd});
}

Reply ReplyFromPacket(std::span<const std::uint8_t> packet) {
  using Kind = Reply::Kind;
  Reply reply;
  if (packet.size() < kMinPacketBytes || packet.size() > kMaxPacketBytes || packet.back() != kEnd) {
    return reply;
  }
  std::copy(packet.begin(), packet.end(), reply.bytes.begin());
  reply.size = packet.size();
  const std::uint8_t header = packet[0], type = packet[1];
  if (header == kToAll) {
    if (packet.size() == 4 && type == 0x30 && packet[2] >= 2 && packet[2] <= kMaxCameras + 1) {
      reply.kind = Kind::kAddressed;
      reply.address = packet[2] - 1;
    } else if (packet.size() == 5 && type == 0x01 && packet[2] == 0x00 && packet[3] == 0x01) {
      reply.kind = Kind::kCleared;
    }
    return reply;
  }
  if (header < 0x90 || (header & 0x0F) != 0) return reply;
  reply.address = (header >> 4) - 8;
  const int group = type & 0xF0;
  if (packet.size() == 3 && type == 0x38) {
    reply.kind = Kind::kNetworkChange;
  } else if (packet.size() == 3 && group == 0x40) {
    reply.kind = Kind::kAck;
  } else if (packet.size() == 3 && group == 0x50) {
    reply.kind = Kind::kDone;
  } else if (group == 0x50) {
    reply.kind = Kind::kAnswer;
  } else if (packet.size() == 4 && group == 0x60) {
    reply.kind = Kind::kError;
    reply.error = packet[2];
  }
  return reply;
}

const char* ErrorText(int error) {
  switch (error) {
    case 0x01:
      return "wrong length";
    case 0x02:
      return "unknown command";
    case 0x03:
      return "command buffer full";
    case 0x04:
      return "cancelled";
    case 0x05:
      return "no such socket";
    case 0x41:
      return "not executable now (is the camera on?)";
    default:
      return "unknown error";
  }
}

std::optional<Reply> Receiver::Push(std::uint8_t byte) {
  if (byte != kEnd) {
    if (size_ < kMaxPacketBytes) bytes_[size_] = byte;
    if (size_ <= kMaxPacketBytes) ++size_;
    return std::nullopt;
  }
  const std::size_t size = size_;
  size_ = 0;
  if (size >= kMaxPacketBytes) return Reply{};  // longer than any packet
  bytes_[size] = kEnd;
  return ReplyFromPacket({bytes_.data(), size + 1});
}

std::optional<std::int32_t> PositionFrom(const Reply& reply) {
  if (reply.kind != Reply::Kind::kAnswer || reply.size != kPositionBytes) return std::nullopt;
  return FourNibbles(reply.bytes.data() + 2);
}

bool LensBlockFrom(const Reply& reply, lens::ZoomReading& reading) {
  if (reply.kind != Reply::Kind::kAnswer || reply.size != kLensBlockBytes) return false;
  const auto zoom = FourNibbles(reply.bytes.data() + 2);
  const auto focus = FourNibbles(reply.bytes.data() + 8);
  if (!zoom || !focus) return false;
  reading.zoom_counts = zoom;
  reading.focus_counts = focus;
  reading.digital_zoom = (reply.bytes[13] & 0x02) != 0;
  reading.motion =
      (reply.bytes[14] & 0x01) != 0 ? lens::LensMotion::kMoving : lens::LensMotion::kSettled;
  return true;
}

Datagram InquiryDatagram(const Request& inquiry, std::uint32_t sequence) {
  return DatagramOf(kInquiry, inquiry.span(), sequence);
}

Datagram SequenceReset() {
  return DatagramOf(kControl, std::span(&kResetSequence, 1), 0);
}

DatagramReply ReplyFromDatagram(std::span<const std::uint8_t> datagram) {
  using Kind = DatagramReply::Kind;
  DatagramReply found;
  if (datagram.empty()) return found;
  if (IsPacket(datagram)) {
    found.kind = Kind::kWithoutHeader;
    return found;
  }
  if (datagram.size() <= kHeaderBytes) return found;
  const unsigned type = static_cast<unsigned>(datagram[0] << 8 | datagram[1]);
  const auto length = static_cast<std::size_t>(datagram[2] << 8 | datagram[3]);
  for (std::size_t i = 4; i < kHeaderBytes; ++i) found.sequence = found.sequence << 8 | datagram[i];
  const auto content = datagram.subspan(kHeaderBytes);
  if (content.size() != length) return found;
  if (type == kReply && IsPacket(content)) {
    found.kind = Kind::kReply;
    found.reply = ReplyFromPacket(content);
  } else if (type == kControlReply && length == 1 && content[0] == kResetSequence) {
    found.kind = Kind::kSequenceReset;
  } else if ((type == kControlReply || type == kControl) && length == 2 &&
             content[0] == kAbnormal && content[1] == kAbnormalSequence) {
    found.kind = Kind::kUnexpectedSequence;
  }
  return found;
}

}  // namespace plumbline::visca
