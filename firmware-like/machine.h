// Control-cycle state machine: from robot state and PLC command to corrected points.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "firmware-like/deflection/landing_uncertainty.h"
#include "firmware-like/snapshot.h"
#include "firmware-like/standstill.h"
#include "firmware-like/tip_fusion.h"

namespace plumbline {

/// Source of the payload's mass and centre of gravity.
struct PayloadPolicy {
  enum class Source { kRobot, kTable, kFixed };
  struct ToolLoad {
    int number = 0;
    double mass_kg = 0;
    std::optional<Vec3> cog_F;  ///< centre of gravity in F [m]; absent: that of the cell
  };
  Source source = Source::kRobot;
  ToolLoad fixed;               ///< for kFixed
  std::vector<ToolLoad> table;  ///< for kTable, selected by the controller's tool number
};

struct MachineConfig {
  model::CellModel cell;
  std::vector<correction::AssemblyPoint> points;
  correction::CorrectionLimits limits;
  PlausibilityLimits plausibility;
  PayloadPolicy payload;
  /// Cameras whose lens must be valid for points to be corrected.
  std::array<bool, model::kMaxCameras> required_lenses{};
};

/// Camera status that the control cycle needs.
struct CameraInput {
  bool configured = false;
  bool lens_valid = false;
  bool board_wanted = false;    ///< the camera requests a calibration
  bool fiducial_moved = false;  ///< a reference tag is not where it was declared
  bool tip_valid = false;       ///< `tip` was measured with the tool at standstill
  MeasuredTip tip;
  double tip_time_s = 0;  ///< time of the latest image used for `tip`, monotonic
};

/// One press of a gauge's button.
struct GaugePress {
  std::uint32_t number = 0;    ///< ascending; 0: none
  std::uint16_t artefact = 0;  ///< number of the gauge in the cell's list of artefacts, from 1
  double reading_m = 0;
  double time_s = 0;              ///< monotonic, of its arrival
  std::optional<double> sigma_m;  ///< standard deviation of the reading
};

/// Inputs of one cycle. Time and the status of background workers are inputs too: the machine reads
/// neither clocks nor devices.
struct MachineInput {
  double now_s = 0;          ///< monotonic
  double utc_s = 0;          ///< UTC since 1970, for time-dependent effects; never stepped in a run
  std::int64_t unix_ms = 0;  ///< wall clock, used only as the time stamp of results
  model::RobotState robot;   ///< the latest reading; may be the same as in the previous cycle
  model::PlcCommand command;  ///< the latest command, executed once per sequence number
  bool cycle_overrun = false;
  bool probes_recorded = false;           ///< probes are written to the journal
  bool probes_pending = false;            ///< not yet recorded: the journal is being opened
  bool storage_unavailable = false;       ///< not recorded: the journal's disk is not writable
  std::uint16_t background_warnings = 0;  ///< warning bits of the background workers
  bool scene_lost = false;                ///< interference was monitored and no longer is
  bool scene_incomplete = false;          ///< some monitored pairs of objects are not measured
  bool reference_refused = false;         ///< the drift monitor's reference probes disagree
  bool quarantined = false;               ///< quarantined probes await a person's decision
  std::array<CameraInput, model::kMaxCameras> cameras;
  /// A press that was not handled yet. It waits while a probe of the PLC is recorded.
  std::optional<GaugePress> gauge;
};

/// The state carried from cycle to cycle: trust in the robot, the solution of each point (seed of
/// the next solution) and the frozen command result. Not thread-safe. Cycle() does not allocate.
class Machine {
 public:
  explicit Machine(const MachineConfig& config);

  /// Searches the inverse-kinematics branch of a point, starting from its taught joints. This is a
  /// thorough search that may take tens of milliseconds. Do not call it in the control cycle or
  /// while another thread runs Cycle(); a background search needs a Machine of its own.
  /// @return  nullopt if no branch was found, or the point has no taught joints
  std::optional<model::JointVector> FindTaughtBranch(std::size_t index);

  /// Marks every point that has taught joints as pending until SetTaughtBranch() is called for it;
  /// until then the cycle does not search for its branch.
  void MarkTaughtBranchesPending();
  /// Hands over the result of FindTaughtBranch(). Call it between cycles or before the first one.
  /// If no branch was found, the cycle searches for one.
  void SetTaughtBranch(std::size_t index, const std::optional<model::JointVector>& found);

  /// Finds and sets the branches of all points, so that the first cycles take no longer than later
  /// ones. Call it before the first cycle.
  void Prepare();

  /// Prepares this machine to replace one that is still running: solves each point that is valid
  /// there, from its present joints, payload and conditions, so that it can be valid in the first
  /// cycle here.
  /// @param previous  configuration of the running machine
  /// @param last      its latest snapshot
  /// @param utc_s     now, as in MachineInput
  void Prepare(const MachineConfig& previous, const Snapshot& last, double utc_s);

  /// The correction that the cycle would find for a point under a payload, with its radius; solved
  /// from `seed`. May take milliseconds; not for the control cycle.
  correction::Correction Preview(const correction::AssemblyPoint& point,
                                 const loads::Payload& payload, const model::JointVector& seed,
                                 correction::BranchSearch search);

  /// Copies the state of the machine that this one replaces. Call it before the first cycle. It
  /// copies the frozen result, the latest probe, the values of points with equal ids (not valid
  /// until recomputed) and the last PLC heartbeat and acknowledge level; if the robot link is kept,
  /// also the trust in its readings.
  enum class RobotLinkContinuity { kKept, kNew };
  void ResumeFrom(const Machine& previous, RobotLinkContinuity link);

  /// Runs one cycle. The returned reference is valid until the next call.
  const Snapshot& Cycle(const MachineInput& input);

  const MachineConfig& config() const { return config_; }
  const Snapshot& snapshot() const { return snapshot_; }  ///< of the last cycle
  const kinematics::Chain& chain() const { return corrector_.arm().chain(); }

 private:
  void CheckInput(const MachineInput& input);
  void ChoosePayload();
  void ReportMotion();
  /// Determines which required cameras have no valid lens; a camera that has not reported yet
  /// counts as having none.
  void CheckRequiredLenses(const MachineInput& input);
  /// The payload for a point or command, which may state its own mass. That mass is assumed to act
  /// at the centre of gravity declared by the cell or, if there is none, at that of the present
  /// load. Tool and payload item are those that the controller reports.
  std::optional<loads::Payload> PayloadAt(const std::optional<double>& own_mass_kg) const;
  /// With the tool and the payload item that the controller reports.
  /// @return  nullopt if one of these is required and not known, or is not declared by the cell
  std::optional<loads::Payload> WithToolAndItem(std::optional<loads::Payload> payload) const;
  /// Conditions read by the cell's effects, for the robot at standstill with this payload.
  effects::Conditions ConditionsOf(const loads::Payload& payload) const;
  /// The inputs of a point's correction that may change from cycle to cycle. The robot's joints are
  /// not an input.
  struct CorrectionInputs {
    double mass_kg = 0;
    Vec3 cog_F = Vec3::Zero();
    int tool = 0;
    std::optional<double> temp_C, t_s;
    bool operator==(const CorrectionInputs&) const = default;
  };
  CorrectionInputs CorrectionInputsFor(const loads::Payload& payload) const;
  /// True if the inputs are so similar that a radius computed for one also applies to the other.
  static bool SameForRadius(const CorrectionInputs& a, const CorrectionInputs& b);
  void RefreshPoints();
  void RefreshPoint(std::size_t index, int& searches_left);
  void RefreshRadii();
  void Execute(const MachineInput& input);
  /// Sets the correction's radius and basis, or its code if no radius can be computed.
  /// @param p_TP  the tool point in the tip's frame [m]
  void StateUncertainty(const loads::Payload& payload, const Vec3& p_TP,
                        correction::Correction& correction);
  /// The loaded tip at the time of a probe.
  struct Prediction {
    loads::Payload payload;
    deflection::LoadedState state;
  };
  /// Checks that the robot's state allows a probe, and predicts the tip.
  /// @param own_mass_kg  payload that the command states
  correction::CorrectionCode PredictProbe(const std::optional<double>& own_mass_kg, Prediction& at);
  /// Fills the probe, without a measurement.
  void TakeProbe(const MachineInput& input, const Prediction& at);
  /// The command's result: the predicted tip pose.
  void ReportPrediction(const Prediction& at);
  /// Records a touch of an artefact, or a reading against it.
  correction::CorrectionCode RecordProbeOnArtefact(const MachineInput& input);
  /// Records the reading of a gauge whose button was pressed.
  correction::CorrectionCode RecordGaugePress(const MachineInput& input);
  /// Executes a probe command: the result holds the predicted tip pose, and its correction is
  /// measured - predicted. A quarantined probe is handled in the same way, but its result is not
  /// valid.
  correction::CorrectionCode RecordProbe(const MachineInput& input,
                                         const std::optional<Vec3>& measured_W);
  /// kOk if a probe can be recorded now, otherwise why it cannot.
  correction::CorrectionCode ProbeRecordingCode(const MachineInput& input) const;
  /// Counts a refused probe. @return the result code for the fault
  correction::CorrectionCode RefuseProbe(ProbeFault fault, const Vec3& measured_W);
  /// Records the tip measured by the camera named in the command, or the mean of all cameras that
  /// see it.
  correction::CorrectionCode RecordProbeByCamera(const MachineInput& input);
  /// Requests or cancels lens calibration for the camera named in the command. Without a camera
  /// number, a start applies to the cameras that request the board (to all if none does), and a
  /// cancellation to all.
  correction::CorrectionCode RequestCalibration(const MachineInput& input);
  HealthInputs HealthInputsFrom(const MachineInput& input) const;
  void ReportStatus(const MachineInput& input);

  MachineConfig config_;
  correction::Corrector corrector_;
  deflection::LandingUncertainty uncertainty_;
  const bool reads_time_;  ///< an effect of the cell depends on time
  PlausibilityFilter filter_;
  StandstillDetector standstill_;
  motion::MotionObserver motion_;
  const ProbeBounds probe_bounds_;
  bool reading_radius_due_ = true;  ///< snapshot_.reading_radius_m must be recomputed
  /// Inverse-kinematics branch of one point and the correction solved on it.
  struct Branch {
    bool search_pending = false;  ///< a background worker is searching for the branch
    std::optional<model::JointVector> solution;  ///< the latest; seed of the next
    struct Search {
      correction::CorrectionCode result =
          correction::CorrectionCode::kPending;  ///< of the latest failed search
      double pause_s = 0;                        ///< between the latest search and the next
      double next_s = 0;                         ///< earliest time of the next search
    } search;
    /// Inputs that `correction` was solved for; it is reused until they change.
    std::optional<CorrectionInputs> inputs;
    correction::Correction correction;  ///< without radius
  };
  std::vector<Branch> branches_;  ///< one per point
  /// Radius at a point and the inputs it was computed for. A radius costs more than a correction,
  /// so only a few are refreshed per cycle, round-robin; until then the basis is unknown.
  struct Radius {
    model::StatedRadius stated;
    std::optional<CorrectionInputs> inputs;
    bool extrapolated = false;
    model::JointVector q;  ///< commanded joints [rad] or [m]
  };
  std::vector<Radius> radii_;
  std::size_t next_radius_ = 0;
  double utc_s_ = 0;
  std::size_t next_search_ = 0;  ///< the point that may search first in the next cycle
  std::optional<Vec3> cog_F_;    ///< centre of gravity of the present load [m]
  std::optional<double> heartbeat_seen_s_;
  std::uint16_t last_heartbeat_ = 0;
  bool acknowledged_ = false;  ///< level of the acknowledge coil in the previous cycle
  Snapshot snapshot_;
};

}  // namespace plumbline
