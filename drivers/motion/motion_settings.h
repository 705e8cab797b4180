// Settings of the motion link.
#pragma once

#include <string>

#include "drivers/motion/motion_codec.h"
#include "firmware-like/motion_offset/motion_correction.h"
#include "firmware-like/motion_offset/motion_offset.h"

namespace plumbline::motion_link {

struct MotionSettings {
  bool enabled = false;
  std::string kind = "rsi";        ///< "rsi" or "egm"
  std::string listen = "0.0.0.0";  ///< IPv4 address of this computer
  int port = 59152;
  std::string robot;  ///< IPv4 address of the controller
  CodecSettings codec;
  motion_offset::OffsetLimits limits;
  motion_offset::CorrectionRules rules;

  bool operator==(const MotionSettings&) const = default;
};

}  // namespace plumbline::motion_link
