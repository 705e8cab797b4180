// Codec of ABB EGM path correction: protobuf messages of egm.proto version 1.1.
#pragma once

#include "drivers/motion/motion_codec.h"

namespace plumbline::motion_link {

/// Reads EgmRobot and writes EgmSensorPathCorr. Only what is needed is read; unknown fields are
/// skipped, as protobuf demands. A path correction has no orientation: rotations are not written.
class EgmCodec final : public MotionCodec {
 public:
  explicit EgmCodec(bool needs_running) : needs_running_(needs_running) {}

  std::string_view Parse(std::string_view datagram, RobotPacket& packet) const override;
  std::size_t Encode(const RobotPacket& packet, const motion_offset::Offset& offset,
                     std::span<char, 512> answer) const override;

 private:
  bool needs_running_;
};

}  // namespace plumbline::motion_link
