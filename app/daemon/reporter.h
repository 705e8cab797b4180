// From snapshots to log lines: each transition once, with what it means for the cell.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/log/log_entry.h"
#include "drivers/robot/robot_link.h"
#include "firmware-like/snapshot.h"

namespace plumbline {

/// Compares what it is shown with what it was shown before. Pure but for the sink.
class Reporter {
 public:
  struct PointName {
    int id;
    std::string name;
  };

  Reporter(std::vector<PointName> points, LogSink sink);

  /// For another configuration: its points are reported anew; the robot link and the trust in its
  /// input only where the link is another. Warnings and probes go on in the machine, and here.
  void Configure(std::vector<PointName> points, bool link_kept);

  /// @param raised  alarm bits of any cycle since the last call, so that a short one is not missed
  void Observe(const Snapshot& snapshot, std::uint16_t raised, const RobotLinkStatus& link);

 private:
  void ObserveLink(const RobotLinkStatus& link, double now_s);
  /// That the link is away; or, while it is, that it is so for a reason that was not told yet.
  void TellLinkAway(const RobotLinkStatus& link, double now_s);
  void ObserveInput(const Snapshot& snapshot, std::uint16_t raised);
  void ObservePoints(const Snapshot& snapshot);
  void ObserveWarnings(const Snapshot& snapshot);
  void ObserveProbes(const ProbeIntake& probes);

  std::vector<PointName> points_;
  LogSink sink_;
  std::optional<bool> connected_;
  double link_since_s_ = 0;
  std::uint64_t link_changes_ = 0;
  std::vector<std::string> link_told_;  ///< why it is away, as it was told since it is
  std::string link_later_;              ///< another reason, which has to last
  double link_later_since_s_ = 0;
  std::optional<InputFault> input_fault_;
  double input_since_s_ = 0;
  std::uint16_t warnings_ = 0;
  ProbeFault probe_fault_ = ProbeFault::kNone;
  std::uint32_t probes_refused_ = 0;  ///< when it was last told that they are taken again
  bool emergency_stop_ = false;
  std::vector<std::optional<CorrectionCode>> codes_;
  std::uint64_t push_changes_ = 0;
};

}  // namespace plumbline
