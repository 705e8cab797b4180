// Design space of further measurements, and candidate measurements as rows of a data set.
#pragma once

#include <optional>

#include "app/measure/diagnosis/blocks.h"

namespace plumbline::measure {

/// Velocity and acceleration at the moment of measurement [rad/s], [rad/s^2] (m for linear joints).
struct Motion {
  model::JointVector qd, qdd;
};

/// Design variables of a measurement and their values. The pose can always be chosen; each other
/// variable only if the rows vary or record it and an explanation to be separated depends on it.
struct DesignSpace {
  model::JointVector low, high;       ///< range of the joints [rad] or [m]
  model::JointVector reach;           ///< length of the last move of a joint whose side is chosen
  std::vector<double> payloads_kg;    ///< ascending
  std::vector<int> approached;        ///< joints (0-based) whose side of approach is chosen
  std::vector<double> waits_s = {0};  ///< before the move to the pose; the first is 0
  std::vector<Motion> motions;        ///< the first is at rest; empty: as in the last row
};

/// A candidate measurement.
struct DesignPoint {
  model::JointVector q;  ///< [rad] or [m]
  double payload_kg = 0;
  /// Direction (-1, 0, 1) of each joint's last move, from a via pose at a distance of
  /// `DesignSpace::reach`. All zero if the robot comes directly from the previous pose.
  model::JointVector side;
  double wait_s = 0;
  std::size_t motion = 0;  ///< index into DesignSpace::motions

  /// Number of choices that cost time: a via pose, a wait, a measurement in motion.
  int Extras() const;
};

/// The region in which the robot was measured: the range of every joint, widened on either side by
/// a quarter of it or at least 5 deg (50 mm), within the joint limits; and the measured payloads.
/// @param blocks  of the explanations to be separated
DesignSpace DesignSpaceOf(const Dataset& data, const std::vector<const Block*>& blocks);

/// Measured payloads [kg], ascending; if there are more than three, the smallest, the median and
/// the largest.
std::vector<double> PayloadsSeen(const Dataset& data);

/// Random poses, each with every payload, reached directly, at rest and without a wait. Half of
/// them are repeated with the other design variables drawn at random, if there are any.
std::vector<DesignPoint> RandomPoints(const DesignSpace& space);

/// The points that differ from a point in one design variable; for a joint, by +-`step` of its
/// range.
std::vector<DesignPoint> Neighbours(const DesignSpace& space, const DesignPoint& point,
                                    double step);

/// The via pose that produces the chosen side of approach; nullopt for a direct move.
std::optional<model::JointVector> ViaPose(const DesignSpace& space, const DesignPoint& point);
/// True if the pose and its via pose are within the range.
bool Within(const DesignSpace& space, const DesignPoint& point);

/// The points as rows, each reached from `previous`. Other quantities (session, temperature,
/// further signals) are those of the last row of `data`.
Dataset CandidateRows(const Dataset& data, const DesignSpace& space,
                      const std::vector<DesignPoint>& points, const effects::Conditions& previous);

/// Sets the conditions of the rows (last moves, sides of approach, times) for an approach from
/// `previous`.
void SetApproach(const effects::Conditions& previous, const DesignSpace& space,
                 const std::vector<DesignPoint>& points, Dataset& rows);

}  // namespace plumbline::measure
