// Sequential design of measurements that separate explanations, with coordinate exchange.
#pragma once

#include <optional>
#include <set>

#include "app/measure/diagnosis/design/discrimination.h"
#include "app/measure/diagnosis/linear/blocks.h"
#include "app/measure/diagnosis/result/diagnosis.h"

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

/// Input of a design.
struct DesignTask {
  const CandidateSet& candidate_set;
  const Model& model;
  Dataset rows;  ///< rows that the answer does not reject
  std::vector<Explanation>
      explanations;          ///< as columns of `candidate_set`; the first is the answer
  double lowest_m = -1e300;  ///< lowest height of a proposed tip in W [m]
  int poses = 6;             ///< maximum number of poses
  int threads = 1;
};

struct PoseDesign {
  std::vector<NextPose> poses;
  std::set<std::size_t> unseparated;  ///< indices into DesignTask::explanations, from 1
  double gain = 0;                    ///< total value of the poses until all are separated
};

/// Greedy design in the order of execution: each pose is reached from the previous one, and waits
/// add up. Both constructor arguments must outlive the object.
class SequentialDesign {
 public:
  SequentialDesign(const DesignTask& task, const DesignSpace& space);

  /// Value of measuring each of these points next: `Discrimination::Gain`, less a tenth for each
  /// choice that costs time; 0 below the lowest tip, near an already proposed pose, or if the
  /// deflected posture does not converge.
  std::vector<double> Values(const std::vector<DesignPoint>& points) const;

  /// Improves a point by coordinate exchange; the value never decreases. Each round makes the best
  /// change of one design variable, or halves the step of the joints if none improves [Meyer &
  /// Nachtsheim 1995, Technometrics 37(1)].
  DesignPoint Improved(const DesignPoint& point) const;

  /// Distance between the answer and its rivals at each of these points; empty if the sagged
  /// posture of one does not converge.
  std::vector<RivalSeparation> SeparationsAt(const std::vector<DesignPoint>& points) const;

  /// Proposes poses until none has enough value. After all explanations are separated, further
  /// poses confirm the result; these are not improved by exchange.
  PoseDesign Run();

 private:
  /// Points as rows without a measurement, with the gradients that the explanations need.
  struct Batch {
    Dataset rows;
    Linearisation linear;
  };

  std::optional<Batch> Linearised(const std::vector<DesignPoint>& points) const;
  std::vector<double> Values(const std::vector<DesignPoint>& points, const Batch& batch) const;
  bool NearProposed(const model::JointVector& q) const;
  bool ViaIsAbove(const DesignPoint& point) const;
  void Propose(const DesignPoint& point, PoseDesign& design);

  const DesignTask& task_;
  const DesignSpace& space_;
  Discrimination discrimination_;
  deflection::InfluenceSet wanted_;
  effects::Conditions previous_;
  std::vector<model::JointVector> proposed_;
};

// Proposal of further measurements that separate rival explanations.

/// Proposes poses in the order of execution, the most informative first (`SequentialDesign`). Uses
/// the measured payloads if these separate all explanations; otherwise some poses are proposed
/// without payload, and a note says so. Another note names rivals that no pose separates.
/// @param answer, rivals  explanations, as columns of `candidate_set`; the scores of the rivals are
///                        those of their nonlinear refits
/// @param diagnosis       receives rival_separations, next_poses, next_poses_separate_all and notes
void AddNextPoses(const CandidateSet& candidate_set, const Model& model,
                  const PerRow<double>& weights, const Explanation& answer,
                  const std::vector<Explanation>& rivals, const DiagnosisOptions& options,
                  Diagnosis& diagnosis);

}  // namespace plumbline::measure
