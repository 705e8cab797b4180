#include "drivers/motion/motion_responder.h"

#include <arpa/inet.h>

#include <utility>

namespace plumbline::motion_link {

using motion_offset::MotionOffset;
using motion_offset::Obstacle;

Result<MotionResponder> MotionResponder::Create(const MotionSettings& settings, double now_s) {
  auto codec = MakeMotionCodec(settings.kind, settings.codec);
  if (!codec) return codec.failure();
  in_addr robot{};
  if (inet_pton(AF_INET, settings.robot.c_str(), &robot) != 1) {
    return Error{"robot must be the IPv4 address of the controller, such as 192.168.1.10"};
  }
  if (FaultOf(settings.limits) != motion_offset::LimitsFault::kNone) {
    return Error{"the limits of [motion] cannot prevent a jump; run `plumbline check`"};
  }
  return MotionResponder(settings, std::move(codec).value(), robot.s_addr, now_s);
}

MotionResponder::MotionResponder(const MotionSettings& settings, std::unique_ptr<MotionCodec> codec,
                                 std::uint32_t robot, double now_s)
    : limits_(settings.limits),
      rules_(settings.rules),
      codec_(std::move(codec)),
      robot_(robot),
      offset_(settings.limits, now_s) {}

void MotionResponder::Restart(double now_s) {
  counters_ = Status();
  offset_ = MotionOffset(limits_, now_s);
}

bool MotionResponder::Take(std::uint32_t from, std::string_view datagram, double now_s) {
  if (from != robot_) {
    ++counters_.foreign;
    counters_.foreign_address = from;
    return false;
  }
  if (!codec_->Parse(datagram, parsed_).empty()) {
    ++counters_.malformed;
    return false;
  }
  const bool waiting = offset_.unanswered().has_value();
  const MotionOffset::Acceptance acceptance =
      offset_.Accept({now_s, parsed_.number, parsed_.running});
  if (acceptance.order != motion_offset::PacketOrder::kNew) ++counters_.out_of_order;
  if (!acceptance.accepted) return false;
  if (waiting) ++counters_.superseded;
  newest_ = parsed_;
  return true;
}

std::size_t MotionResponder::Answer(const motion_offset::CycleReport& report,
                                    const motion_offset::MotionModel* model, bool stopping,
                                    std::span<char, 512> answer) {
  if (!offset_.unanswered()) return 0;
  MotionOffset::Order order;
  order.obstacle = Obstacle::kStopping;
  if (!stopping) {
    order = OrderFor(report, model, rules_, newest_.q, offset_.offset(),
                     offset_.unanswered()->received_s);
  }
  const std::optional<motion_offset::Offset> offset = offset_.Next(order);
  ++counters_.answered;
  counters_.wanted_m = order.obstacle == Obstacle::kNone ? order.wanted.translation.norm() : 0;
  counters_.late = newest_.late.value_or(0);
  return codec_->Encode(newest_, *offset, answer);
}

status::MotionLinkStatus MotionResponder::Status() const {
  using State = status::MotionLinkState;
  status::MotionLinkStatus status = counters_;
  status.obstacle = offset_.obstacle();
  status.offset_m = offset_.offset().translation.norm();
  status.lost += offset_.lost();
  status.streams += offset_.streams();
  status.state = status.obstacle == Obstacle::kNoPackets ? State::kWaiting
                 : !offset_.answering()                  ? State::kNotAnswering
                 : status.obstacle == Obstacle::kNone    ? State::kCorrecting
                                                         : State::kAnswering;
  return status;
}

}  // namespace plumbline::motion_link
