// Log reporter: turns changes between snapshots into log lines, each transition once.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/base/log/log_entry.h"
#include "drivers/robot/robot_link.h"
#include "firmware-like/snapshot.h"
#include "firmware-like/status/motion_link_status.h"

namespace plumbline::cell {

/// Compares each snapshot with the previous one. Pure except for the sink.
class Reporter {
 public:
  struct PointName {
    int id;
    std::string name;
  };

  Reporter(std::vector<PointName> points, log::LogSink sink);

  /// The cell in force, whose declared and measured tools and payload items the texts name.
  void SetCell(model::CellModel cell) { cell_ = std::move(cell); }

  /// After a reload: reports all points again, and the robot link and input only if the link was
  /// replaced. Warnings and probes continue, as they do in the machine.
  void Configure(std::vector<PointName> points, bool link_kept);

  /// @param raised  alarm bits of all cycles since the last call, so that short alarms are reported
  void Observe(const Snapshot& snapshot, std::uint16_t raised, const robot::RobotLinkStatus& link);

  /// @param problem  why its port cannot be opened; empty if it is open
  void ObserveMotion(const status::MotionLinkStatus& motion, const std::string& problem,
                     double now_s);

 private:
  void ObserveLink(const robot::RobotLinkStatus& link, double now_s);
  void ReportNotices(const robot::RobotLinkStatus& link);
  /// Reports that the link is down, or while it is, a new reason that has persisted.
  void ReportLinkDown(const robot::RobotLinkStatus& link, double now_s);
  void ObserveInput(const Snapshot& snapshot, std::uint16_t raised);
  void ObserveRequiredLenses(const Snapshot& snapshot);
  void ObservePoints(const Snapshot& snapshot);
  std::string OutsideText(const Snapshot& snapshot, const PointResult& point) const;
  void ObserveWarnings(const Snapshot& snapshot);
  void ObserveProbes(const ProbeIntake& probes);

  std::vector<PointName> points_;
  model::CellModel cell_;
  UndeclaredNumber undeclared_;  ///< named by the last reports of refused points
  log::LogSink sink_;
  std::optional<bool> connected_;
  double link_since_s_ = 0;
  std::uint64_t link_changes_ = 0;
  std::vector<std::string> logged_reasons_;  ///< why the link is down, in this outage
  std::string new_reason_;                   ///< logged once it has persisted
  double new_reason_since_s_ = 0;
  std::optional<InputFault> input_fault_;
  double input_since_s_ = 0;
  std::uint16_t lenses_missing_ = 0;
  double lenses_since_s_ = 0;
  std::uint16_t warnings_ = 0;
  ProbeFault probe_fault_ = ProbeFault::kNone;
  std::uint32_t logged_refusals_ = 0;  ///< total when probes were last logged as accepted again
  bool emergency_stop_ = false;
  std::vector<std::optional<correction::CorrectionCode>> codes_;
  std::uint64_t push_changes_ = 0;
  std::uint64_t notices_ = 0;
  status::MotionLinkStatus motion_;  ///< as last logged
  double motion_ignored_s_ = -1e300;
};

}  // namespace plumbline::cell
