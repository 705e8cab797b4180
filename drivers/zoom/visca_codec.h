// VISCA: packets of cameras on a serial line <-> values. Pure.
//
// A packet is a header, 1..14 bytes and FF. Headers: 8x to camera x, 88 to all; from camera x to
// the controller 90 + 10 (x - 1), which is 90 for camera 1 .. F0 for camera 7.
// [Sony, EVI-D70 Technical Manual, "VISCA RS-232C Commands"]
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware-like/lens/zoom_reading.h"

namespace plumbline::visca {

inline constexpr std::size_t kLongestPacket = 16, kShortestPacket = 3;
inline constexpr int kMostCameras = 7;
inline constexpr std::size_t kPositionBytes = 7, kLensBlockBytes = 16;
inline constexpr std::int32_t kOpticalMaxCounts = 0x4000;  ///< EVI-D70, FCB: digital beyond it

/// A packet to send.
struct Request {
  std::array<std::uint8_t, 6> bytes{};
  std::size_t size = 0;
  std::span<const std::uint8_t> span() const { return {bytes.data(), size}; }
};

Request AddressSet();                ///< to all; each takes the next number
Request ZoomPosition(int address);   ///< answered by PositionFrom()
Request FocusPosition(int address);  ///< likewise
Request LensBlock(int address);      ///< answered by LensBlockFrom()

/// One packet from the line.
struct Reply {
  enum class Kind : std::uint8_t {
    kAddressed,      ///< answer to AddressSet()
    kCleared,        ///< answer to a controller's IF_Clear, which inquiries do not need
    kNetworkChange,  ///< a camera was added or taken away: all must be addressed again
    kAck,
    kDone,
    kAnswer,  ///< to an inquiry; it does not say to which one
    kError,
    kMalformed,
  };
  Kind kind = Kind::kMalformed;
  int address = 0;  ///< of the sender; of kAddressed: cameras on the line
  int error = 0;    ///< of kError, see ErrorText()
  std::array<std::uint8_t, kLongestPacket> bytes{};
  std::size_t size = 0;  ///< with header and FF
};

/// One packet, FF included; whatever is no reply is kMalformed.
Reply ReplyFromPacket(std::span<const std::uint8_t> packet);

/// What an error byte means: "not executable now".
const char* ErrorText(int error);

/// Cuts a stream at each FF. More than kLongestPacket bytes without one are thrown away up to the
/// next FF.
class Receiver {
 public:
  /// @return the packet that this byte ends
  std::optional<Reply> Push(std::uint8_t byte);
  void Clear() { size_ = 0; }

 private:
  std::array<std::uint8_t, kLongestPacket> bytes_{};
  std::size_t size_ = 0;  ///< kLongestPacket + 1 while throwing away
};

/// Counts of `y0 50 0p 0q 0r 0s FF`; nothing where the answer is none of a position.
std::optional<std::int32_t> PositionFrom(const Reply& reply);

/// Zoom, focus, digital zoom and motion of a lens block; its time is left alone. Digital zoom that
/// is enabled counts as on: the block does not tell whether it enlarges at this moment.
/// @return  false where the answer is no lens block; `reading` is then as it was
bool LensBlockFrom(const Reply& reply, ZoomReading& reading);

}  // namespace plumbline::visca
