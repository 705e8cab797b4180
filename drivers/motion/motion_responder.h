// What the motion link does with each datagram, without socket and clock.
#pragma once

#include <memory>

#include "drivers/motion/motion_settings.h"
#include "firmware-like/status/motion_link_status.h"

namespace plumbline::motion_link {

/// Time is an input. Does not allocate after Create(). Not thread-safe.
class MotionResponder {
 public:
  /// @param now_s  begin of the listening
  /// @return       why these settings cannot be used
  static Result<MotionResponder> Create(const MotionSettings& settings, double now_s);

  /// Forgets everything but the counters: the listening begins again.
  void Restart(double now_s);
  /// Takes a datagram, in the order of arrival.
  /// @param from  IPv4 address of its sender, network byte order
  /// @return      true if it is to be answered, unless another one changes that before
  bool Take(std::uint32_t from, std::string_view datagram, double now_s);
  /// The answer to the newest packet for which Take() returned true. @return  its size; 0: nothing
  /// is to be answered
  /// @param model     null: nothing is corrected
  /// @param stopping  the offset returns to 0
  std::size_t Answer(const motion_offset::CycleReport& report,
                     const motion_offset::MotionModel* model, bool stopping,
                     std::span<char, 512> answer);
  /// To be called while nothing arrives.
  void Idle(double now_s) { offset_.Idle(now_s); }

  const motion_offset::Offset& offset() const { return offset_.offset(); }
  /// Without what only the device knows: not_sent, longest_answer_s, kNoSocket.
  status::MotionLinkStatus Status() const;

 private:
  MotionResponder(const MotionSettings& settings, std::unique_ptr<MotionCodec> codec,
                  std::uint32_t robot, double now_s);

  motion_offset::OffsetLimits limits_;
  motion_offset::CorrectionRules rules_;
  std::unique_ptr<MotionCodec> codec_;
  std::uint32_t robot_;  ///< IPv4, network byte order
  motion_offset::MotionOffset offset_;
  RobotPacket parsed_, newest_;  ///< newest_: of offset_.unanswered()
  status::MotionLinkStatus counters_;
};

}  // namespace plumbline::motion_link
