// The PLC's side of the demo: go to each point as taught, then as corrected, and see where the
// loaded tool lands.
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
  double settle_s = 0.3;   ///< after a move, before the tracker is read
  int samples = 8;         ///< tracker readings, averaged
};

class AssemblyClient {
 public:
  AssemblyClient(const AssemblyClientOptions& options, const MotionProgram& program);

  void AttachPayload() { Command(kAttach); }
  void ReleasePayload() { Command(kRelease); }
  /// Both landings at one point. @throws std::runtime_error where the robot or the daemon refuses.
  Landing Visit(const TaughtPoint& point);
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
  Motion MeasureTip();
  Motion Land(const TaughtPoint& point, const Motion& X_BP);

  AssemblyClientOptions options_;
  RegisterLayout layout_;
  RegisterClient robot_, tracker_, daemon_;
};

}  // namespace virtual_cell
