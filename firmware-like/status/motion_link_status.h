// Status of the motion link: corrections inside the motion.
#pragma once

#include <cstdint>

#include "firmware-like/motion_offset/motion_offset.h"

namespace plumbline::status {

enum class MotionLinkState : std::uint16_t {
  kOff = 0,           ///< not configured
  kWaiting = 1,       ///< the controller sends nothing
  kAnswering = 2,     ///< answered with an offset that is 0 or returns to 0
  kCorrecting = 3,    ///< answered with the offset that the model demands
  kNotAnswering = 4,  ///< the controller sends, but is not answered until its stream ends
  kNoSocket = 5,      ///< the UDP port cannot be opened
};

/// Counters are since the start of the link.
struct MotionLinkStatus {
  MotionLinkState state = MotionLinkState::kOff;
  motion_offset::Obstacle obstacle = motion_offset::Obstacle::kOff;
  double offset_m = 0;  ///< size of the last answer
  double wanted_m = 0;  ///< size that the model demands
  std::uint64_t answered = 0;
  std::uint64_t lost = 0;          ///< packets missing before another one
  std::uint64_t superseded = 0;    ///< packets not answered because a newer one was there already
  std::uint64_t foreign = 0;       ///< from another address than the controller's
  std::uint64_t malformed = 0;     ///< from the controller's address, but not its message
  std::uint64_t out_of_order = 0;  ///< repeated, reordered or of another sequence
  std::uint64_t not_sent = 0;      ///< answers that the system refused to send
  std::uint64_t streams = 0;       ///< that were answered
  std::uint64_t late = 0;          ///< late answers, as the controller counts them
  double longest_answer_s = 0;     ///< from the packet's arrival in the kernel to the answer
  std::uint32_t foreign_address = 0;  ///< IPv4 of the latest foreign packet, network byte order
};

constexpr const char* Describe(MotionLinkState state) {
  switch (state) {
    case MotionLinkState::kOff:
      return "off";
    case MotionLinkState::kWaiting:
      return "waiting for the controller";
    case MotionLinkState::kAnswering:
      return "answering, not correcting";
    case MotionLinkState::kCorrecting:
      return "correcting";
    case MotionLinkState::kNotAnswering:
      return "not answering";
    case MotionLinkState::kNoSocket:
      return "UDP port not open";
  }
  return "?";
}

}  // namespace plumbline::status
