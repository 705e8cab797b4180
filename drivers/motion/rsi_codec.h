// Codec of KUKA RSI over Ethernet: XML text, one datagram per cycle.
#pragma once

#include "drivers/motion/motion_codec.h"

namespace plumbline::motion_link {

/// Reads `<Rob ...><AIPos A1=".." .. A6=".."/><Delay D="n"/><IPOC>n</IPOC></Rob>`: elements and
/// attributes in any order, with any others between them. Writes the answer
///   <Sen Type="ImFree"><RKorr X=".." Y=".." Z=".." A=".." B=".." C=".."/><IPOC>n</IPOC></Sen>
/// X, Y, Z in mm; A, B, C in degrees, R = Rz(A) Ry(B) Rx(C).
class RsiCodec final : public MotionCodec {
 public:
  explicit RsiCodec(RsiNames names) : names_(std::move(names)) {}

  /// Bounded by the size of the datagram; elements at most four deep. DOCTYPE, CDATA and comments
  /// are refused: a controller sends none.
  std::string_view Parse(std::string_view datagram, RobotPacket& packet) const override;
  std::size_t Encode(const RobotPacket& packet, const motion_offset::Offset& offset,
                     std::span<char, 512> answer) const override;

 private:
  RsiNames names_;
};

/// Largest length of a name in RsiNames, so that an answer fits.
inline constexpr std::size_t kLongestRsiName = 32;

}  // namespace plumbline::motion_link
