// The machine: one whole cycle from robot state to corrected points.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "firmware-like/deflection/landing_uncertainty.h"
#include "firmware-like/snapshot.h"
#include "firmware-like/standstill.h"
#include "firmware-like/tip_fusion.h"

namespace plumbline {

/// Where the payload's mass and centre of gravity come from.
struct PayloadPolicy {
  enum class Source { kRobot, kTable, kFixed };
  struct ToolLoad {
    int number = 0;
    double mass_kg = 0;
    std::optional<Vec3> cog_F;
  };
  Source source = Source::kRobot;
  ToolLoad fixed;               ///< of kFixed
  std::vector<ToolLoad> table;  ///< of kTable, by the controller's tool number
};

struct MachineConfig {
  CellModel cell;
  std::vector<AssemblyPoint> points;
  CorrectionLimits limits;
  PlausibilityLimits plausibility;
  PayloadPolicy payload;
};

/// What a camera's watch knows, as far as the cycle needs it.
struct CameraInput {
  bool configured = false;
  bool lens_valid = false;
  bool board_wanted = false;    ///< its calibration is asked for
  bool fiducial_moved = false;  ///< a reference tag is not where it was declared
  bool tip_valid = false;       ///< the tool stood still before the camera
  MeasuredTip tip;
  double tip_time_s = 0;  ///< of its newest image, monotonic
};

/// What a cycle is given. Time and the two mailboxes' contents are inputs: the machine reads no
/// clock and no device.
struct MachineInput {
  double now_s = 0;          ///< monotonic
  double utc_s = 0;          ///< UTC since 1970 for effects of time; even within a run
  std::int64_t unix_ms = 0;  ///< wall clock, only to stamp results with
  RobotState robot;          ///< the newest reading, old or new
  PlcCommand command;        ///< the newest command, executed when its sequence is new
  bool cycle_overrun = false;
  bool probes_recorded = false;      ///< somebody takes what a probe gives
  bool probes_pending = false;       ///< not yet: the journal is being opened
  bool storage_unavailable = false;  ///< why not: the disk cannot be written
  std::uint16_t loop_warnings = 0;   ///< warning bits of what works beside the cycle
  bool scene_lost = false;           ///< interference was supervised and is no longer
  bool scene_incomplete = false;     ///< watched pairs of objects are not measured
  bool reference_refused = false;    ///< the drift monitor's reference probes disagree
  bool quarantined = false;          ///< probes wait for a person's decision
  std::array<CameraInput, kMostCameras> cameras;
};

/// Holds the state between cycles: trust in the robot, the solution of each point (the next
/// cycle's starting value), the frozen result. After construction nothing allocates.
class Machine {
 public:
  explicit Machine(const MachineConfig& config);

  /// The branch of a point, found from the joints where it was taught. Searches thoroughly: up to
  /// tens of milliseconds. Not for the cycle, and not while another thread runs this machine's:
  /// whoever searches beside the cycle has a machine of its own.
  /// @return  nothing where none was found, or the point names no joints
  std::optional<JointVector> FindTaughtBranch(std::size_t index);

  /// Every point that names the joints where it was taught is pending from now on, until its
  /// branch is taken: the cycle searches nothing for it meanwhile.
  void AwaitTaughtBranches();
  /// Between two cycles, or before the first. Where no branch was found, the cycle searches.
  void TakeTaughtBranch(std::size_t index, const std::optional<JointVector>& found);

  /// Finds and takes the branches of all points, so that the first cycles are as short as the
  /// others.
  void Prepare();

  /// Prepares the points of a machine that follows another one which still runs: each point valid
  /// there is solved from its present joints, with the payload and the conditions of that moment,
  /// so that it can be valid in the first cycle here.
  /// @param former  that machine's configuration, `last` its newest snapshot
  /// @param utc_s   now, as in MachineInput
  void Prepare(const MachineConfig& former, const Snapshot& last, double utc_s);

  /// The answer to a point under a payload, solved from `seed` as Prepare() does, with its radius:
  /// what the cycle will find there. May take milliseconds; not for the cycle.
  Correction Preview(const AssemblyPoint& point, const Payload& payload, const JointVector& seed,
                     BranchSearch search);

  /// Goes on where another configuration's machine stopped, before the first cycle: its frozen
  /// result and its probe, the values of the points of equal id (not valid until computed), the
  /// PLC's levels; where the robot's readings come over the same link, the trust in them as well.
  enum class RobotLinkIs { kKept, kNew };
  void TakeOver(const Machine& former, RobotLinkIs link);

  /// One cycle. The reference stays valid until the next one.
  const Snapshot& Cycle(const MachineInput& input);

  const MachineConfig& config() const { return config_; }
  const Snapshot& snapshot() const { return snapshot_; }  ///< of the last cycle
  const Chain& chain() const { return corrector_.arm().chain(); }

 private:
  void JudgeInput(const MachineInput& input);
  void ChoosePayload();
  /// The payload for a point or command that may name its own mass: that mass has its centre where
  /// the cell declares it, and only where the cell does not, where the load now carried has it.
  std::optional<Payload> PayloadAt(const std::optional<double>& own_mass_kg) const;
  /// What effects of the cell read, for the robot at rest with this payload.
  Conditions ConditionsOf(const Payload& payload) const;
  /// What a point's correction depends on and may change from cycle to cycle. The robot's joints
  /// are not among it.
  struct Circumstances {
    double mass_kg = 0;
    Vec3 cog_F = Vec3::Zero();
    std::optional<double> temp_C, t_s;
    bool operator==(const Circumstances&) const = default;
  };
  Circumstances CircumstancesOf(const Payload& payload) const;
  /// Whether a radius computed for one holds for the other, as payloads and small drifts go.
  static bool SameForRadius(const Circumstances& a, const Circumstances& b);
  void RefreshPoints();
  void RefreshPoint(std::size_t index, int& searches_left);
  void RenewRadii();
  void Execute(const MachineInput& input);
  /// Fills in the correction's radius and its basis; the code where there is none.
  /// @param p_TP  the tool point in the tip's frame [m]
  void StateUncertainty(const Payload& payload, const Vec3& p_TP, Correction& correction);
  /// Answers a probe: the result holds the predicted tip, its correction is measured - predicted;
  /// likewise, without the valid bit, where the probe is quarantined.
  CorrectionCode TakeProbe(const MachineInput& input, const std::optional<Vec3>& measured_W);
  /// Why no probe can be recorded now, kOk where it can.
  CorrectionCode ProbeRecording(const MachineInput& input) const;
  /// Counts a refused probe. @return the result code of that fault
  CorrectionCode RefuseProbe(ProbeFault fault, const Vec3& measured_W);
  /// By the camera that the command names, or by all that see the tip now.
  CorrectionCode TakeProbeByCamera(const MachineInput& input);
  /// Of the camera that the command names; without a number of those that ask for the board, or,
  /// where none does, of all; cancelled likewise, of all.
  CorrectionCode OrderCalibration(const MachineInput& input);
  HealthFacts FactsOf(const MachineInput& input) const;
  void ReportStatus(const MachineInput& input);

  MachineConfig config_;
  Corrector corrector_;
  LandingUncertainty uncertainty_;
  const bool reads_time_;  ///< the cell's effects
  PlausibilityFilter filter_;
  StandstillWatch standstill_;
  const ProbeBounds probe_bounds_;
  bool reading_radius_due_ = true;  ///< snapshot_.reading_radius_m is another model's
  /// What is known of a point's branch.
  struct Branch {
    bool awaited = false;                 ///< somebody searches it beside the cycle
    std::optional<JointVector> solution;  ///< the last one: the next one's starting value
    struct Search {
      CorrectionCode verdict = CorrectionCode::kPending;  ///< of the last one, where it failed
      double pause_s = 0;                                 ///< before the next, and its moment
      double next_s = 0;
    } search;
    /// The solution's correction, without its radius; as long as these hold it is not solved again.
    std::optional<Circumstances> circumstances;
    Correction correction;
  };
  std::vector<Branch> branches_;  ///< one a point
  /// Radius at each point, and the circumstances that it holds for. It costs more than a
  /// correction, so that a few are renewed a cycle, in turn; until then its basis is unknown.
  struct Radius {
    StatedRadius stated;
    std::optional<Circumstances> of;
    bool extrapolated = false;
    JointVector q;  ///< commanded there
  };
  std::vector<Radius> radii_;
  std::size_t radius_turn_ = 0;
  double utc_s_ = 0;
  std::size_t turn_ = 0;       ///< the point whose turn to search is first
  std::optional<Vec3> cog_F_;  ///< of what is carried
  std::optional<double> heartbeat_seen_s_;
  std::uint16_t last_heartbeat_ = 0;
  bool acknowledged_ = false;  ///< the level of the acknowledging coil
  Snapshot snapshot_;
};

}  // namespace plumbline
