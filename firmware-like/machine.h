// The machine: one whole cycle from robot state to corrected points.
#pragma once

#include <optional>
#include <vector>

#include "firmware-like/snapshot.h"

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

/// What a cycle is given. Time and the two mailboxes' contents are inputs: the machine reads no
/// clock and no device.
struct MachineInput {
  double now_s = 0;          ///< monotonic
  std::int64_t unix_ms = 0;  ///< wall clock, only to stamp results with
  RobotState robot;          ///< the newest reading, old or new
  PlcCommand command;        ///< the newest command, executed when its sequence is new
  bool cycle_overrun = false;
};

/// Holds the state between cycles: trust in the robot, the solution of each point (the next
/// cycle's starting value), the frozen result. After construction nothing allocates.
class Machine {
 public:
  explicit Machine(const MachineConfig& config);

  /// Finds the branch of every point that names the joints where it was taught, so that the first
  /// cycles are as short as the others. May take milliseconds a point; not for the cycle.
  void Prepare();

  /// One cycle. The reference stays valid until the next one.
  const Snapshot& Cycle(const MachineInput& input);

  const MachineConfig& config() const { return config_; }

 private:
  void JudgeInput(const MachineInput& input);
  void ChoosePayload();
  /// A payload of that mass at the centre of gravity in force; nothing where either is not known.
  std::optional<Payload> PayloadOf(std::optional<double> mass_kg) const;
  /// The payload for a point or command that may name its own mass.
  std::optional<Payload> PayloadAt(const std::optional<double>& own_mass_kg) const;
  void RefreshPoints();
  void RefreshPoint(std::size_t index, int& searches_left);
  void Execute(const MachineInput& input);
  void ReportStatus(const MachineInput& input);

  MachineConfig config_;
  Corrector corrector_;
  PlausibilityFilter filter_;
  std::vector<std::optional<JointVector>> solutions_;  ///< of each point, in the actual posture
  std::optional<Vec3> cog_F_;                          ///< of what is carried
  std::uint16_t last_heartbeat_ = 0;
  std::optional<double> heartbeat_seen_s_;
  bool first_command_ = true;
  bool acknowledged_ = false;  ///< the level of the acknowledging coil
  Snapshot snapshot_;
};

}  // namespace plumbline
