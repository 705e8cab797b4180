// The PLC's side of the demo: go to each point as taught, then as corrected, and see where the
// loaded tool lands; have the tip measured at probing poses and tell the daemon.
#pragma once

#include <string>

#include "tests/virtual_cell/landing_table.h"
#include "tests/virtual_cell/register_client.h"
#include "tests/virtual_cell/robot_registers.h"

namespace virtual_cell {

struct AssemblyClientOptions {
  std::string robot = {}, tracker = {}, daemon = {};  ///< "HOST:PORT"
  Profile profile = Profile::kUr;
  int unit = 1;
  double patience_s = 30;  ///< for a connection, a move, a corrected point
  /// After a move, before the tip is measured. At least the daemon's stale_after_ms: then whatever
  /// it still trusts was read at rest.
  double settle_s = 0.3;
  int samples = 8;  ///< tracker readings of a landing, averaged; a probe is one reading
};

/// What the daemon says to one probe.
struct ProbeAnswer {
  Vec3 residual_W_mm = Vec3::Zero();  ///< measured minus predicted
  bool alarm = false;                 ///< the drift alarm, this probe included
};

class AssemblyClient {
 public:
  AssemblyClient(const AssemblyClientOptions& options, const MotionProgram& program);

  void AttachPayload() { Command(kAttach); }
  void ReleasePayload() { Command(kRelease); }
  /// Both landings at one point. @throws std::runtime_error where the robot or the daemon refuses.
  Landing Visit(const TaughtPoint& point);
  /// Goes to the point as taught, measures the tip once and gives it to the daemon (command 6).
  /// Returns when the probe is in the journal.
  ProbeAnswer Probe(const TaughtPoint& point);
  /// Version of the corrected model that waits for approval, within `patience_s`.
  /// @throws std::runtime_error where none comes, or the diagnosis failed
  int AwaitProposal(double patience_s);
  /// Whether the daemon has a block for this point.
  bool HasPoint(int id) { return FindBlock(id) >= 0; }

 private:
  struct Corrected {
    Motion X_BP = Motion::Identity();
    double correction_mm = 0, uncertainty_mm = 0;
  };

  void Command(int code, const Motion& X_BT = Motion::Identity());
  int FindBlock(int id);
  Corrected AwaitCorrected(const TaughtPoint& point);
  Motion MeasureTip(int samples);
  Motion Land(const TaughtPoint& point, const Motion& X_BP);
  void AwaitRecording();
  int GiveProbe(const Vec3& tip_W_mm);

  AssemblyClientOptions options_;
  RegisterLayout layout_;
  RegisterClient robot_, tracker_, daemon_;
};

}  // namespace virtual_cell
