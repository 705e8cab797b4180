// Control-cycle state machine: from robot state and PLC command to corrected points.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "firmware-like/correction/cell_corrector.h"
#include "firmware-like/machine_input.h"
#include "firmware-like/model/robot_state.h"
#include "firmware-like/payload_selection.h"
#include "firmware-like/point_corrections.h"
#include "firmware-like/snapshot.h"

namespace plumbline {

// Standstill detector for the robot, based on its joint readings.

/// The robot is at standstill once no joint has moved for this long. It exceeds the refresh period
/// of the slowest controller (PlausibilityLimits::slowest_refresh_s), so that the readings of a
/// moving arm change at least once within this time.
inline constexpr double kStandstill_s = 0.2;

/// A joint has moved if it differs from its reference position by more than 1.5 steps of its
/// register (a value at the edge of a step alternates between two adjacent ones) and by more than
/// this threshold, which is above the jitter of a servo that holds its position: 0.1 mrad is 0.3 mm
/// at 3 m [rad] or [m].
inline constexpr double kSmallestMotion = 1e-4;

/// Detects motion by comparing each reading with a reference position, which is updated only when a
/// joint has moved, not with the previous reading; slow creep therefore accumulates. Speeds from
/// 0.5 mrad/s are detected within kStandstill_s, slower ones intermittently. Does not allocate.
class StandstillDetector {
 public:
  /// @param reading  trusted; may be the same as in the previous call
  void Observe(const model::RobotState& reading) {
    const double allowed = std::max(kSmallestMotion, 1.5 * reading.q_resolution);
    const bool comparable = reference_ && reference_->size() == reading.q.size();
    const bool moved = comparable && (reading.q - *reference_).cwiseAbs().maxCoeff() > allowed;
    if (moved) moved_s_ = reading.timestamp_s;
    if (moved || !comparable) reference_ = reading.q;
  }

  /// False until the first motion is detected, because the first reading has no reference.
  bool Moving(double now_s) const { return moved_s_ && now_s - *moved_s_ <= kStandstill_s; }

 private:
  std::optional<model::JointVector> reference_;
  std::optional<double> moved_s_;  ///< time stamp of the latest reading in which a joint had moved
};

// Heartbeat of the PLC: a counter that it changes while its program runs.

/// Optional for the PLC: until the counter has changed once, it is neither alive nor lost.
class PlcHeartbeat {
 public:
  void Observe(std::uint16_t counter, double now_s) {
    if (counter != counter_) {
      counter_ = counter;
      changed_s_ = now_s;
    }
    alive_ = changed_s_ && now_s - *changed_s_ < kTimeout_s;
  }

  bool alive() const { return alive_; }
  bool lost() const { return changed_s_ && !alive_; }

 private:
  static constexpr double kTimeout_s = 2.0;
  std::uint16_t counter_ = 0;
  std::optional<double> changed_s_;
  bool alive_ = false;
};

struct MachineConfig {
  model::CellModel cell;
  std::vector<correction::AssemblyPoint> points;
  correction::CorrectionLimits limits;
  PlausibilityLimits plausibility;
  PayloadPolicy payload;
  /// Cameras whose lens must be valid for points to be corrected.
  std::array<bool, model::kMaxCameras> required_lenses{};
  /// Each cycle states the radius where the robot is, for corrections inside the motion.
  bool states_present_radius = false;
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

  /// Conditions read by the cell's effects, for the robot at standstill with this payload.
  effects::Conditions ConditionsOf(const loads::Payload& payload) const;

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
  /// Computes the error that the resolution of the joint readings causes at the tip.
  /// @param moved  since the last computation, or another tool
  void CheckResolution(bool moved);
  void ChoosePayload();
  void ReportMotion();
  /// Determines which required cameras have no valid lens; a camera that has not reported yet
  /// counts as having none.
  void CheckRequiredLenses(const MachineInput& input);
  void RefreshPoints();
  /// States the radius of the loaded tip at the robot's present joints.
  void StatePresentRadius();
  /// The radii stay, but nothing supports them: their basis is unknown.
  void WithdrawBasis();
  void Execute(const MachineInput& input);
  /// Corrects the commanded point or pose, or predicts where it lands, into the result.
  correction::CorrectionCode ExecuteCorrection(const model::PlcCommand& command);
  /// Solves for the commanded point or pose, and states its radius.
  correction::CorrectionCode Solve(const model::PlcCommand& command,
                                   const correction::AssemblyPoint& point,
                                   const loads::Payload& payload, const model::JointVector& seed);
  std::optional<std::size_t> IndexOfPoint(int id) const;
  /// The result of a command without a payload of its own: this cycle's correction of the point.
  correction::CorrectionCode ReportPoint(std::size_t index);
  correction::CorrectionCode ExecuteProbe(const MachineInput& input);
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
  void ReportStatus(const MachineInput& input);

  MachineConfig config_;
  correction::CellCorrector corrector_;
  PayloadSelector payload_;
  PointCorrections points_;
  PlausibilityFilter filter_;
  StandstillDetector standstill_;
  motion::MotionObserver motion_;
  const ProbeBounds probe_bounds_;
  bool reading_radius_due_ = true;  ///< snapshot_.reading_radius_m must be recomputed
  PlcHeartbeat plc_heartbeat_;
  double utc_s_ = 0;
  bool acknowledged_ = false;  ///< level of the acknowledge coil in the previous cycle
  Snapshot snapshot_;
  bool basis_withdrawn_ = false;  ///< of the points in the snapshot
};

}  // namespace plumbline
