// VISCA codec: packets between a controller and cameras, on a serial line or in datagrams. Pure.
//
// A packet is a header, 1..14 bytes and FF. Header to camera x: 8x, to all: 88. Header from camera
// x to the controller: 90 + 10 (x - 1), from 90 for camera 1 to F0 for camera 7 (hexadecimal).
// [Sony, EVI-D70 Technical Manual, "VISCA RS-232C Commands"]
//
// VISCA over IP puts one packet into each UDP datagram, behind a header of 8 bytes: type (0110
// inquiry, 0111 reply, 0200 control command, 0201 control reply), length of the rest and sequence
// number, big-endian. A reply has the sequence number of its request. The control command 01 sets
// the sequence number to 0; the message 0F 01, as a command or a reply, reports one that the camera
// did not expect. [Sony, BRC-X400 / SRG-X400 Command List, "VISCA over IP"]
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware-like/lens/zoom_reading.h"

namespace plumbline::visca {

inline constexpr std::size_t kMaxPacketBytes = 16, kMinPacketBytes = 3;
inline constexpr int kMaxCameras = 7;
inline constexpr std::size_t kPositionBytes = 7, kLensBlockBytes = 16;
inline constexpr std::int32_t kOpticalMaxCounts = 0x4000;  ///< EVI-D70, FCB; digital zoom above it

/// A packet to send.
struct Request {
  std::array<std::uint8_t, 6> bytes{};
  std::size_t size = 0;
  std::span<const std::uint8_t> span() const { return {bytes.data(), size}; }
};

Request AddressSet();                ///< broadcast; each camera takes the next address
Request ZoomPosition(int address);   ///< decode the reply with PositionFrom()
Request FocusPosition(int address);  ///< decode the reply with PositionFrom()
Request LensBlock(int address);      ///< decode the reply with LensBlockFrom()

/// One received packet.
struct Reply {
  enum class Kind : std::uint8_t {
    kAddressed,      ///< reply to AddressSet()
    kCleared,        ///< reply to IF_Clear, which is not used for inquiries
    kNetworkChange,  ///< a camera was added or removed: addresses must be assigned again
    kAck,
    kDone,
    kAnswer,  ///< to an inquiry; does not identify which
    kError,
    kMalformed,
  };
  Kind kind = Kind::kMalformed;
  int address = 0;  ///< sender; for kAddressed: number of cameras on the line
  int error = 0;    ///< for kError, see ErrorText()
  std::array<std::uint8_t, kMaxPacketBytes> bytes{};
  std::size_t size = 0;  ///< including header and FF
};

/// Decodes one packet including FF; anything that is not a reply is kMalformed.
Reply ReplyFromPacket(std::span<const std::uint8_t> packet);

/// Text for an error byte, for example "not executable now".
const char* ErrorText(int error);

/// Splits a byte stream into packets at each FF. A packet longer than kMaxPacketBytes is discarded
/// up to the next FF.
class Receiver {
 public:
  /// @return the packet if this byte completes one
  std::optional<Reply> Push(std::uint8_t byte);
  void Clear() { size_ = 0; }

 private:
  std::array<std::uint8_t, kMaxPacketBytes> bytes_{};
  std::size_t size_ = 0;  ///< kMaxPacketBytes + 1 while discarding
};

/// Counts in `y0 50 0p 0q 0r 0s FF`; nullopt if the reply is not a position.
std::optional<std::int32_t> PositionFrom(const Reply& reply);

/// Decodes zoom, focus, digital zoom and motion from a lens block; time_s is not changed. Digital
/// zoom counts as on if it is enabled, because the block does not report whether it is active right
/// now.
/// @return  false if the reply is not a lens block; `reading` is then unchanged
bool LensBlockFrom(const Reply& reply, lens::ZoomReading& reading);

inline constexpr int kUdpPort = 52381, kTcpPort = 5678;
inline constexpr std::size_t kHeaderBytes = 8;

/// A datagram to send.
struct Datagram {
  std::array<std::uint8_t, kHeaderBytes + 6> bytes{};
  std::size_t size = 0;
  std::span<const std::uint8_t> span() const { return {bytes.data(), size}; }
};

Datagram InquiryDatagram(const Request& inquiry, std::uint32_t sequence);
Datagram SequenceReset();

/// One received datagram.
struct DatagramReply {
  enum class Kind : std::uint8_t {
    kReply,
    kSequenceReset,       ///< reply to SequenceReset()
    kUnexpectedSequence,  ///< the camera rejects the sequence number of a request
    kWithoutHeader,       ///< a packet as on a serial line: not VISCA over IP
    kMalformed,
  };
  Kind kind = Kind::kMalformed;
  std::uint32_t sequence = 0;  ///< of the request
  Reply reply;                 ///< for kReply
};

/// Decodes one datagram; anything that is not a reply is kMalformed.
DatagramReply ReplyFromDatagram(std::span<const std::uint8_t> datagram);

}  // namespace plumbline::visca
