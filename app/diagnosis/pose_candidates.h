// Measurements that might be made next: what of them can be chosen, and candidates as rows of a
// data set without a measurement.
#pragma once

#include <optional>

#include "app/diagnosis/blocks.h"

namespace plumbline {

/// Velocity and acceleration at the moment of measurement [rad/s], [rad/s^2] (m of a slide).
struct Motion {
  JointVector qd, qdd;
};

/// What can be chosen of a measurement: the pose, and each of the others where the rows vary or
/// record it and an explanation among those to be separated depends on it.
struct DesignSpace {
  JointVector low, high;              ///< range of the joints [rad] or [m]
  JointVector reach;                  ///< last move of a joint approached from a side
  std::vector<double> payloads_kg;    ///< ascending
  std::vector<int> approached;        ///< joints (0-based) whose side of approach matters
  std::vector<double> waits_s = {0};  ///< before the move there; none first
  std::vector<Motion> motions;        ///< at rest first; empty: as in the last row
};

/// A measurement that might be made.
struct DesignPoint {
  JointVector q;  ///< [rad] or [m]
  double payload_kg = 0;
  /// Sign of each joint's last move, made from a via pose `DesignSpace::reach` away; 0 of those
  /// that do not move there. All zero: directly from the pose before.
  JointVector side;
  double wait_s = 0;
  std::size_t motion = 0;  ///< of DesignSpace::motions

  /// Choices that cost time beside the pose: a via pose, a wait, a measurement in motion.
  int Extras() const;
};

/// Where the robot has worked: every joint within the rows' range, widened by a quarter of it and
/// at least 5 degrees (50 mm) on either side, within the joint's limits. At the payloads seen.
/// @param blocks  of the explanations that are to be separated
DesignSpace DesignSpaceOf(const Dataset& data, const std::vector<const Block*>& blocks);

/// Payloads [kg] at which the rows were measured, ascending; of more than three the least, the
/// middle and the largest.
std::vector<double> PayloadsSeen(const Dataset& data);

/// Random poses, each with every payload: directly, at rest and without a wait; half of them once
/// more with the other choices drawn, where there are any.
std::vector<DesignPoint> RandomPoints(const DesignSpace& space);

/// The points that differ from one by one choice; of a joint, by `step` of its range either way.
std::vector<DesignPoint> Neighbours(const DesignSpace& space, const DesignPoint& point,
                                    double step);

/// Where the robot passes so that it comes from the side chosen; nothing where it comes directly.
std::optional<JointVector> ViaPose(const DesignSpace& space, const DesignPoint& point);
/// True where joints and via pose are within the range.
bool Within(const DesignSpace& space, const DesignPoint& point);

/// The points as rows, each reached from `previous`. What nobody chooses (session, temperature,
/// further signals) is as in the last row of `data`, times count from it.
Dataset CandidateRows(const Dataset& data, const DesignSpace& space,
                      const std::vector<DesignPoint>& points, const Conditions& previous);

/// Lets the rows of these points be reached from `previous`: last moves, sides, and times.
void ComeFrom(const Conditions& previous, const DesignSpace& space,
              const std::vector<DesignPoint>& points, Dataset& rows);

}  // namespace plumbline
