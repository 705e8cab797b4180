// The configured points as the daemon will solve them: under which payload, in which posture.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "firmware-like/machine.h"

namespace plumbline {

/// A payload that the configuration names for a point.
struct PointLoad {
  std::string name;                ///< "2 kg", "tool 3, 2 kg", "no payload"
  std::optional<Payload> payload;  ///< absent: its centre of gravity is not declared
};

/// The point's own payload, the fixed one, or that of each tool number, one after the other. Where
/// only the robot knows it (source = "robot"): none, then [payload] mass_kg where it is declared.
std::vector<PointLoad> LoadsOf(const MachineConfig& config, const AssemblyPoint& point);

/// Joints from which a point is searched: where it was taught. For a point without near_deg the
/// daemon takes the robot's joints at the start, which nobody knows here: the middle of the ranges.
JointVector SeedOf(const Chain& chain, const AssemblyPoint& point);

/// A point under one of its payloads.
struct PointSolution {
  std::size_t point = 0;  ///< index of the configured point
  PointLoad load;
  Correction correction;  ///< its code says why there is none; then q may still be known
  PointPosture posture;   ///< where correction.q is known
};

/// Every point under each of its payloads, in configured order, as Machine::Prepare() finds them.
/// Takes some milliseconds a point.
std::vector<PointSolution> SolvePoints(const MachineConfig& config);

}  // namespace plumbline
