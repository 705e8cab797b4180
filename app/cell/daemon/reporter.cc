#include "app/cell/daemon/reporter.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <utility>

#include "app/base/config/carried_numbers.h"
#include "firmware-like/model/radius_coverage.h"

namespace plumbline::cell {
namespace {

struct WarningText {
  std::uint16_t bit;
  log::Event event;
  std::optional<log::Event> end;
  const char* raised;
  const char* cleared;
};

constexpr double kReasonPersists_s = 2;
constexpr double kIgnoredPeriod_s = 10;
constexpr std::size_t kMaxReasons = 8;  // logged in one outage

constexpr WarningText kWarnings[] = {
    {warning::kDecodingUnchecked,
     log::Event::kJointsUnchecked,
     {},
     "no tool pose is read: joint values cannot be checked against forward kinematics",
     nullptr},
    {warning::kPlcHeartbeatLost, log::Event::kHeartbeatLost, log::Event::kHeartbeatBack,
     "PLC heartbeat lost", "PLC heartbeat is back"},
    {warning::kCycleOverrun, log::Event::kCycleLate, log::Event::kCycleOnTime,
     "control cycle started late: the machine is overloaded, or another real-time task "
     "occupies its CPU",
     "control cycle is on time again"},
    {warning::kMassCentresGuessed,
     log::Event::kMassGuessed,
     {},
     "a link has no link_com_mm: its centre of mass is assumed, so joint deflections are estimates",
     nullptr},
    {warning::kTwoMasters, log::Event::kTwoMasters, log::Event::kOneMaster,
     nullptr,  // logged with addresses
     "one client alone writes the command window again"},
};

std::string RadiusText(const correction::Correction& correction) {
  return fmt::format("±{:.2f} mm ({})", 1e3 * correction.uncertainty_m,
                     model::CoverageText(correction.basis));
}

std::string FaultText(const ProbeIntake& probes) {
  const Vec3 mm = 1e3 * probes.measured_W;
  const std::string place = fmt::format("({:.6g}, {:.6g}, {:.6g}) mm", mm.x(), mm.y(), mm.z());
  switch (probes.fault) {
    case ProbeFault::kZero:
      return "it is 0, 0, 0: the registers were not filled. Write position and sequence in one "
             "request, after the instrument has measured";
    case ProbeFault::kInMetres:
      return place +
             " contradicts the model, but a thousand times that value does not: is it given in "
             "metres? Command 6 takes mm, command 7 takes 0.001 mm";
    case ProbeFault::kBeyondReach:
      return fmt::format(
          "{} is farther from the base than the {:.2f} m reach of arm and tool. "
          "Check the unit, the byte order and the measurement frame",
          place, probes.reach_m);
    case ProbeFault::kRobotMoving:
      return "the robot moved while the probe was given. Keep it at standstill for 0.2 s (register "
             "424), measure, then give the probe";
    case ProbeFault::kNone:
      break;
  }
  return "";
}

}  // namespace

Reporter::Reporter(std::vector<PointName> points, log::LogSink sink)
    : points_(std::move(points)), sink_(std::move(sink)), codes_(points_.size()) {}

void Reporter::Configure(std::vector<PointName> points, bool link_kept) {
  points_ = std::move(points);
  codes_.assign(points_.size(), std::nullopt);
  if (link_kept) return;
  connected_.reset();
  link_since_s_ = 0;
  link_changes_ = push_changes_ = 0;
  logged_reasons_.clear();
  new_reason_.clear();
  new_reason_since_s_ = 0;
  input_fault_.reset();
  input_since_s_ = 0;
}

void Reporter::Observe(const Snapshot& snapshot, std::uint16_t raised,
                       const robot::RobotLinkStatus& link) {
  ObserveLink(link, snapshot.now_s);
  ObserveInput(snapshot, raised);
  ObserveRequiredLenses(snapshot);
  ObservePoints(snapshot);
  ObserveWarnings(snapshot);
  ObserveProbes(snapshot.probes);
}

void Reporter::ObserveLink(const robot::RobotLinkStatus& link, double now_s) {
  if (link.push_changes != push_changes_) {
    push_changes_ = link.push_changes;
    if (link.push_result == robot::LinkResult::kOk) {
      sink_({log::Event::kPushWorks, "push to the controller works again"});
    } else {
      sink_({log::Event::kPushFailed,
             fmt::format("push to the controller: {}", link.push_problem.view())});
    }
  }
  ReportNotices(link);
  // No reading was attempted yet: neither connected nor lost.
  if (link.readings == 0 && link.failures == 0) return;
  const bool interrupted = connected_ == true && link.connected && link.changes != link_changes_;
  link_changes_ = link.changes;
  if (interrupted)
    sink_({log::Event::kRobotLinkInterrupted, "robot link lost and restored at once"});
  if (!link.connected) ReportLinkDown(link, now_s);
  if (connected_ == link.connected) return;
  if (link.connected) {
    sink_({log::Event::kRobotLinkUp,
           connected_ ? fmt::format("robot link restored after {:.1f} s", now_s - link_since_s_)
                      : "robot link up"});
  }
  connected_ = link.connected;
  link_since_s_ = now_s;
}

void Reporter::ReportNotices(const robot::RobotLinkStatus& link) {
  constexpr std::uint64_t kKept = robot::RobotLinkStatus::kKeptNotices;
  if (link.notice_count < notices_) notices_ = 0;  // another link
  notices_ = std::max(notices_, link.notice_count - std::min(link.notice_count, kKept));
  for (; notices_ < link.notice_count; ++notices_) {
    sink_({log::Event::kRobotNotice, std::string(link.notices[notices_ % kKept].view())});
  }
}

void Reporter::ReportLinkDown(const robot::RobotLinkStatus& link, double now_s) {
  const std::string_view reason = link.problem.view();
  const bool was_down = connected_ == false;
  if (was_down) {
    if (reason != new_reason_) {
      new_reason_ = reason;
      new_reason_since_s_ = now_s;
    }
    const bool logged =
        std::find(logged_reasons_.begin(), logged_reasons_.end(), reason) != logged_reasons_.end();
    if (logged || logged_reasons_.size() >= kMaxReasons) return;
    if (now_s - new_reason_since_s_ < kReasonPersists_s) return;
  }
  const bool lost = link.readings > 0;
  const std::string_view remedy = robot::LinkRemedy(link.result);
  const std::string before = was_down ? fmt::format(" (before: {})", logged_reasons_.back()) : "";
  if (!was_down) logged_reasons_.clear();
  sink_({lost ? log::Event::kRobotLinkLost : log::Event::kRobotLinkAbsent,
         fmt::format("robot link {}: {}{}{}{}", lost ? "lost" : "not established", reason, before,
                     remedy.empty() ? "" : "; ", remedy)});
  logged_reasons_.emplace_back(reason);
  new_reason_ = reason;
}

namespace {

/// Names both tools if the controller reports the tip of one and the number of another.
std::string OtherTipText(const Snapshot& snapshot) {
  if (snapshot.input_fault != InputFault::kTcpMismatch || !snapshot.tip_of_tool) return "";
  return fmt::format(
      ": it is the tip of tool {}, but the tool number is {}; set both in the controller to the "
      "mounted tool",
      *snapshot.tip_of_tool,
      snapshot.reading.tool_number ? fmt::format("{}", *snapshot.reading.tool_number) : "unknown");
}

}  // namespace

void Reporter::ObserveInput(const Snapshot& snapshot, std::uint16_t raised) {
  InputFault fault = snapshot.input_fault;
  const bool brief_fault =
      fault == InputFault::kOk && input_fault_ == InputFault::kOk &&
      (raised & (alarm::kRobotStale | alarm::kRobotImplausible | alarm::kDecodingWrong)) != 0;
  if (brief_fault)
    sink_({log::Event::kRobotBrieflyUntrusted, "robot input was not trusted for a few cycles"});
  const bool emergency_stop = (snapshot.alarms & alarm::kEmergencyStop) != 0;
  if (fault == InputFault::kOk && emergency_stop != emergency_stop_) {
    emergency_stop_ = emergency_stop;
    sink_(
        emergency_stop
            ? log::LogEntry{log::Event::kEmergencyStop, "the controller reports an emergency stop"}
            : log::LogEntry{log::Event::kEmergencyStopReleased, "the emergency stop is released"});
  }
  if (fault == input_fault_) return;
  if (fault == InputFault::kOk) {
    sink_({log::Event::kRobotTrusted, input_fault_ && *input_fault_ != InputFault::kMissing
                                          ? fmt::format("robot input trusted again after {:.1f} s",
                                                        snapshot.now_s - input_since_s_)
                                          : "robot input trusted"});
  } else if (fault != InputFault::kMissing) {
    const std::string_view remedy = RemedyOf(fault);
    sink_(
        {log::Event::kRobotNotTrusted,
         fmt::format("robot input not trusted: {}{}; corrected points withdrawn{}{}",
                     Describe(fault), OtherTipText(snapshot), remedy.empty() ? "" : "; ", remedy)});
  }
  input_fault_ = fault;
  input_since_s_ = snapshot.now_s;
}

void Reporter::ObserveRequiredLenses(const Snapshot& snapshot) {
  if (snapshot.input_fault != InputFault::kOk) return;  // the points are withdrawn for that reason
  const std::uint16_t missing = snapshot.lenses_missing;
  if (missing == lenses_missing_) return;
  if (missing == 0) {
    sink_({log::Event::kPointsRestored,
           fmt::format("corrected points are served again after {:.1f} s: the required lens is "
                       "valid",
                       snapshot.now_s - lenses_since_s_)});
  } else {
    sink_({log::Event::kPointsWithdrawn,
           fmt::format("corrected points withdrawn: {} not valid, and required_for demands it",
                       missing == 1   ? "the lens of camera 1 is"
                       : missing == 2 ? "the lens of camera 2 is"
                                      : "the lenses of cameras 1 and 2 are")});
  }
  if (lenses_missing_ == 0) lenses_since_s_ = snapshot.now_s;
  lenses_missing_ = missing;
}

std::string Reporter::OutsideText(const Snapshot& snapshot, const PointResult& point) const {
  if (!point.correction.extrapolated) return "";
  const std::string unmeasured =
      config::UnmeasuredText(cell_, snapshot.payload.tool, snapshot.payload.item);
  return ", outside the calibrated range" + (unmeasured.empty() ? "" : ": " + unmeasured);
}

void Reporter::ObservePoints(const Snapshot& snapshot) {
  // Reported once for all points, by ObserveInput() and ObserveRequiredLenses().
  if (snapshot.input_fault != InputFault::kOk || snapshot.lenses_missing != 0) return;
  const config::NumberAdvice advice = config::AdviceOn(snapshot.undeclared, cell_);
  if (snapshot.undeclared != undeclared_) {  // refused again because of another number
    for (auto& code : codes_) {
      if (code == correction::CorrectionCode::kPayloadUnknown) code.reset();
    }
    undeclared_ = snapshot.undeclared;
  }
  for (std::size_t k = 0; k < points_.size() && k < snapshot.points.size(); ++k) {
    const PointResult& point = snapshot.points[k];
    if (point.code == correction::CorrectionCode::kPending || codes_[k] == point.code) continue;
    codes_[k] = point.code;
    if (point.valid) {
      const double correction_mm = 1e3 * point.correction.translation_B.norm();
      sink_(
          {log::Event::kPointCorrected,
           fmt::format("point {} ({}) corrected by {:.2f} mm, {}{}", points_[k].id, points_[k].name,
                       correction_mm, RadiusText(point.correction), OutsideText(snapshot, point)),
           {{"POINT", fmt::format("{}", points_[k].id)},
            {"CORRECTION_MM", fmt::format("{:.3f}", correction_mm)}}});
    } else {
      const bool named =
          point.code == correction::CorrectionCode::kPayloadUnknown && !advice.problem.empty();
      sink_({log::Event::kPointRefused,
             fmt::format("point {} ({}) has no correction: {}{}", points_[k].id, points_[k].name,
                         Describe(point.code),
                         named ? fmt::format(": {}; {}", advice.problem, advice.remedy) : ""),
             {{"POINT", fmt::format("{}", points_[k].id)},
              {"CODE", fmt::format("{}", static_cast<int>(point.code))}}});
    }
  }
}

namespace {

std::string AddressText(std::uint32_t ipv4) {
  std::array<char, INET_ADDRSTRLEN> text{};
  inet_ntop(AF_INET, &ipv4, text.data(), text.size());
  return text.data();
}

}  // namespace

void Reporter::ObserveMotion(const status::MotionLinkStatus& motion, const std::string& problem,
                             double now_s) {
  using State = status::MotionLinkState;
  const auto logged = std::exchange(motion_, motion);
  const auto streams = [](State state) {
    return state == State::kAnswering || state == State::kCorrecting;
  };
  const bool other_stream = streams(motion.state) && motion.streams != logged.streams;
  if (other_stream || (streams(motion.state) && !streams(logged.state))) {
    sink_({log::Event::kMotionAnswering, streams(logged.state)
                                             ? "motion link: the controller is answered again, "
                                               "after a stop shorter than 0.1 s"
                                             : "motion link: the controller is answered"});
  }
  if (motion.state != logged.state) {
    if (motion.state == State::kNoSocket)
      sink_({log::Event::kMotionPortFailed, fmt::format("motion link: {}", problem)});
    if (motion.state == State::kNotAnswering) {
      sink_({log::Event::kMotionNotAnswered,
             fmt::format("motion link: {}; {}", Describe(motion.obstacle),
                         RemedyOf(motion.obstacle))});
    }
    if (motion.state == State::kWaiting && logged.state != State::kOff &&
        logged.state != State::kNoSocket) {
      sink_({log::Event::kMotionEnded, "motion link: the controller sends nothing any more"});
    }
    if (motion.state == State::kCorrecting) {
      sink_({log::Event::kMotionCorrecting,
             fmt::format("motion corrected: {:.2f} mm wanted", 1e3 * motion.wanted_m)});
    }
  }
  if (motion.state == State::kAnswering &&
      (motion.obstacle != logged.obstacle || logged.state != motion.state)) {
    const std::string_view remedy = RemedyOf(motion.obstacle);
    sink_({log::Event::kMotionNotCorrecting,
           fmt::format("motion not corrected: {}{}{}", Describe(motion.obstacle),
                       remedy.empty() ? "" : "; ", remedy)});
  }
  const std::uint64_t foreign = motion.foreign - std::min(logged.foreign, motion.foreign);
  const std::uint64_t malformed = motion.malformed - std::min(logged.malformed, motion.malformed);
  if (foreign + malformed == 0) return;
  if (now_s - motion_ignored_s_ < kIgnoredPeriod_s) {  // counted with the next report
    motion_.foreign = logged.foreign;
    motion_.malformed = logged.malformed;
    return;
  }
  motion_ignored_s_ = now_s;
  const auto counted = [&](std::uint64_t count, const std::string& text) {
    return count == foreign + malformed ? text : fmt::format("{} {}", count, text);
  };
  std::vector<std::string> reasons;
  if (foreign > 0) {
    reasons.push_back(counted(
        foreign, "from " + AddressText(motion.foreign_address) + ", which is not the controller"));
  }
  if (malformed > 0) {
    reasons.push_back(counted(malformed, "not of the form that the configured interface sends"));
  }
  sink_({log::Event::kMotionIgnored,
         fmt::format("motion link: {} packet{} ignored: {}", foreign + malformed,
                     foreign + malformed == 1 ? "" : "s", fmt::join(reasons, "; "))});
}

void Reporter::ObserveProbes(const ProbeIntake& probes) {
  const std::uint32_t since = probes.refused - logged_refusals_;
  if (probes.fault != ProbeFault::kNone && probes.fault != probe_fault_) {
    sink_({log::Event::kProbeRefused,
           "probe refused and not recorded: " + FaultText(probes),
           {{"FAULT", fmt::format("{}", static_cast<int>(probes.fault))}}});
  }
  if (probe_fault_ != ProbeFault::kNone && probes.fault == ProbeFault::kNone) {
    sink_({log::Event::kProbesAccepted,
           fmt::format("probes are accepted again; {} were refused", since)});
    logged_refusals_ = probes.refused;
  }
  probe_fault_ = probes.fault;
}

void Reporter::ObserveWarnings(const Snapshot& snapshot) {
  if (snapshot.input_fault != InputFault::kOk) return;
  for (const WarningText& text : kWarnings) {
    const bool now = (snapshot.warnings & text.bit) != 0;
    if (now == ((warnings_ & text.bit) != 0)) continue;
    if (now && text.raised != nullptr) sink_({text.event, text.raised});
    if (!now && text.end) sink_({*text.end, text.cleared});
  }
  if ((snapshot.warnings & ~warnings_ & warning::kCoarseJoints) != 0) {
    const double radius_mm = 1e3 * snapshot.reading_radius_m;
    sink_(
        {log::Event::kJointsCoarse,
         fmt::format("joint registers are coarse: their resolution costs {:.2f} mm at the tip (95 "
                     "%), and probes cannot reveal smaller effects. Use finer registers",
                     radius_mm)});
  }
  warnings_ = snapshot.warnings;
}

}  // namespace plumbline::cell
