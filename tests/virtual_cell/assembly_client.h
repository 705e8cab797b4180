// PLC client of the demo: visits assembly points as taught and as corrected and measures where the
// loaded tool lands; measures probes and sends them to the daemon.
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
  double patience_s = 30;  ///< timeout for a connection, a move, a corrected point
  /// Delay between a move and the measurement. At least the daemon's stale_after_ms, so that every
  /// reading that the daemon still trusts was taken at standstill.
  double settle_s = 0.3;
  int samples = 8;  ///< tracker readings of a landing, averaged; a probe is one reading
};

/// The daemon's response to one probe.
struct ProbeAnswer {
  Vec3 residual_W_mm = Vec3::Zero();  ///< measured minus predicted
  bool alarm = false;                 ///< drift alarm after this probe
};

class AssemblyClient {
 public:
  AssemblyClient(const AssemblyClientOptions& options, const MotionProgram& program);

  void AttachPayload() { Command(kAttach); }
  void ReleasePayload() { Command(kRelease); }
  /// Both landings at one point. @throws std::runtime_error if the robot or the daemon refuses
  Landing Visit(const TaughtPoint& point);
  /// Moves to the point as taught, measures the tip once and sends it to the daemon (command 6).
  /// Returns when the probe is in the journal.
  ProbeAnswer Probe(const TaughtPoint& point);
  /// Waits up to `patience_s` for a corrected model that awaits approval. @return its version
  /// @throws std::runtime_error on timeout or if the diagnosis failed
  int AwaitProposal(double patience_s);
  /// True if the daemon has a register block for this point.
  bool HasPoint(int id) { return FindBlock(id) >= 0; }

 private:
  struct Corrected {
    Motion X_BP = Motion::Identity();
    double correction_mm = 0, uncertainty_mm = 0;
    int basis = 0;
    bool extrapolated = false;
  };

  void Command(int code, const Motion& X_BT = Motion::Identity());
  int FindBlock(int id);
  Corrected AwaitCorrected(const TaughtPoint& point);
  Motion MeasureTip(int samples);
  Motion Land(const TaughtPoint& point, const Motion& X_BP);
  void AwaitRecording();
  int SendProbe(const Vec3& tip_W_mm);

  AssemblyClientOptions options_;
  RegisterLayout layout_;
  RegisterClient robot_, tracker_, daemon_;
};

}  // namespace virtual_cell
