// Sequential design of measurements that separate explanations, with coordinate exchange.
#pragma once

#include <set>

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/diagnosis/discrimination.h"
#include "app/measure/diagnosis/pose_candidates.h"

namespace plumbline::measure {

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

}  // namespace plumbline::measure
