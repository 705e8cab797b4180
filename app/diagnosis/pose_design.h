// Sequential design of the measurements that separate explanations: the best candidate, improved
// by coordinate exchange, then the best beside it, and so on.
#pragma once

#include <set>

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/discrimination.h"
#include "app/diagnosis/pose_candidates.h"

namespace plumbline {

/// What a design is made for.
struct DesignTask {
  const Pool& pool;
  const Model& model;
  Dataset rows;                           ///< that the answer does not reject
  std::vector<Explanation> explanations;  ///< of the pool; the first is the answer
  double lowest_m = -1e300;               ///< height in W [m] below which no tip is proposed
  int poses = 6;                          ///< at most
  int threads = 1;
};

struct PoseDesign {
  std::vector<NextPose> poses;
  std::set<std::size_t> unseparated;  ///< rivals, counted from 1
  double gain = 0;                    ///< of the poses until all are separated
};

/// Each pose in the order of execution: it is reached from the one before, waits add up.
class SequentialDesign {
 public:
  SequentialDesign(const DesignTask& task, const DesignSpace& space);

  /// What measuring each of these points next is worth: `Discrimination::Gain`, a tenth less for
  /// each choice that costs time; 0 below the lowest tip, near a pose that is proposed already, or
  /// where the posture does not settle.
  std::vector<double> Values(const std::vector<DesignPoint>& points) const;

  /// The best point that coordinate exchange finds from one, never one of less value: each round
  /// takes the best of all changes of one choice, or halves the step of the joints [Meyer &
  /// Nachtsheim 1995, Technometrics 37(1)].
  DesignPoint Improved(const DesignPoint& point) const;

  /// Proposes poses until none is worth the way. Once all explanations are separated, further poses
  /// confirm; these are not improved.
  PoseDesign Run();

 private:
  /// Points as rows without a measurement, with the gradients that the explanations need.
  struct Batch {
    Dataset rows;
    Linearisation linear;
  };

  std::optional<Batch> Linearised(const std::vector<DesignPoint>& points) const;
  std::vector<double> Values(const std::vector<DesignPoint>& points, const Batch& batch) const;
  bool NearProposed(const JointVector& q) const;
  bool ViaIsAbove(const DesignPoint& point) const;
  void Propose(const DesignPoint& point, PoseDesign& design);

  const DesignTask& task_;
  const DesignSpace& space_;
  Discrimination discrimination_;
  InfluenceSet wanted_;
  Conditions previous_;
  std::vector<JointVector> proposed_;
};

}  // namespace plumbline
