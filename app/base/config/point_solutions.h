// Offline solutions of the configured points, as the daemon computes them: payload and posture.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/kinematics/inverse.h"
#include "firmware-like/machine.h"

namespace plumbline::config {

// Text on a tool that is loaded beyond linear beam theory.

/// Says by how much the tip deflection exceeds the range of linear theory (linear_range.h), or that
/// the material yields, and what to do. Empty if neither.
/// @param state  converged state of `arm`, which is that of `cell`
std::string BeyondLinearTheory(const model::CellModel& cell, const deflection::LoadedArm& arm,
                               const deflection::LoadedState& state);

/// A configured payload of a point.
struct PointLoad {
  std::string name;                       ///< "2 kg", "tool 3, 2 kg", "no payload"
  std::optional<loads::Payload> payload;  ///< absent if its centre of gravity is not declared
};

/// The payloads to consider for a point: its own, the fixed one, or that of each tool number. If
/// only the robot knows the payload (source = "robot"): none, then [payload] mass_kg if declared.
/// If the cell has several tools: each payload with the tool that was mounted when the point was
/// taught (TaughtTool), or with every tool if that is unknown.
std::vector<PointLoad> LoadsOf(const MachineConfig& config, const correction::AssemblyPoint& point);

/// Initial joints for solving a point: those at which it was taught. Without near_deg the daemon
/// starts from the robot's joints, which are unknown here; the middle of the joint ranges replaces
/// them.
model::JointVector SeedOf(const kinematics::Chain& chain, const correction::AssemblyPoint& point);

/// A point under one of its payloads.
struct PointSolution {
  std::size_t point = 0;  ///< index of the configured point
  PointLoad load;
  correction::Correction
      correction;  ///< if it failed, the code gives the reason; q may be known nevertheless
  correction::PointPosture posture;  ///< set if correction.q is known
  std::string out_of_range;  ///< inputs outside the fitted range, see OutOfRangeText; empty if none
  std::string beyond_linear;     ///< what linear beam theory does not describe; empty if nothing
  std::string orientation_left;  ///< what the arm cannot take of the orientation; empty if nothing
};

/// Solves every point under each of its payloads, in configured order, like Machine::Prepare().
/// Takes some milliseconds per point.
/// @param progress  called with the number of solved points before each point; may be empty
std::vector<PointSolution> SolvePoints(const MachineConfig& config,
                                       const std::function<void(std::size_t)>& progress = {});

/// The orientations that an arm cannot take; empty if it takes all.
std::string OrientationText(kinematics::Orientation orientation);

/// The frame that points are in: the cell's, or the instrument's.
std::string PointFrameText(const model::CellModel& cell);

/// What to declare if no point is moved by its correction, with the cause; empty if one is, or if
/// none has a correction. Judged by the corrections themselves, since joints without a compliance
/// and a tool in the direction of gravity leave nothing to correct, whatever keys are present.
std::string NothingCorrectedText(const MachineConfig& config,
                                 const std::vector<PointSolution>& solutions);

/// Why a point has no corrected point, and what to do.
std::string FailureAdvice(const correction::Correction& correction,
                          const correction::CorrectionLimits& limits);

}  // namespace plumbline::config
