// Postures and paths of the motions of a program.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/programs/correction/motion_path.h"
#include "app/programs/correction/path_corrector.h"
#include "app/programs/correction/program_arm.h"

namespace plumbline::programs {

/// Posture at the end of a motion.
struct MotionEnd {
  std::optional<model::JointVector> q;     ///< nominal
  std::string unknown;                     ///< why not
  model::JointVector last_move, approach;  ///< of the drives; empty: not known
};

/// Follows the motions of a program from one to the next.
class MotionEnds {
 public:
  /// The arguments must outlive the object.
  /// @param start_q  posture where a program is started; absent: not known
  MotionEnds(ProgramArm& arm, const Flow& flow, const std::optional<model::JointVector>& start_q)
      : arm_(arm),
        flow_(flow),
        start_q_(start_q),
        search_(arm.solver()),
        reads_approach_(ReadsApproach(arm.arm())) {}

  /// Finds the postures at the ends of all motions.
  /// @return  false if `progress` ended it
  bool Find(const std::function<bool(double)>& progress);

  const Flow& flow() const { return flow_; }
  const MotionEnd& operator[](std::size_t motion) const { return ends_[motion]; }
  bool reads_approach() const { return reads_approach_; }

  /// Pose of a target of a motion as it is stated, in B. An auxiliary point that states no
  /// orientation has that of the end.
  Result<Pose> StatedPose(std::size_t motion, const Target& target);
  /// The orientation of a target in its base, for an auxiliary point that states none.
  std::optional<Mat3> OrientationOfEnd(std::size_t motion) const;

  /// The stated path of the tool point in B, of a linear or circular motion; nullopt if it is not
  /// known.
  /// @param pose  of the end and the auxiliary point, in B
  std::optional<MotionPath> PathOf(
      std::size_t motion, const Pose& start,
      const std::function<std::optional<Pose>(const Target&)>& pose) const;

  /// The posture at the auxiliary point of a circular motion.
  Result<model::JointVector> PostureAtVia(std::size_t motion, const Pose& X_BP);

 private:
  const MotionAt& At(std::size_t motion) const { return flow_.motions[motion]; }
  /// Postures in which a motion may start, as far as they have been found.
  struct Starts {
    std::vector<model::JointVector> q;  ///< each once
    bool unknown = false;               ///< it may also start in others
    std::string why;
  };
  Starts StartsOf(std::size_t motion, const std::vector<bool>& open) const;
  std::optional<model::JointVector> StartOf(std::size_t motion) const;
  Result<model::JointVector> PostureAtEnd(std::size_t motion,
                                          const std::optional<model::JointVector>& from,
                                          const std::string& no_seed);
  MotionEnd EndFrom(std::size_t motion, const Starts& starts);
  std::optional<MotionPath> StatedPath(std::size_t motion, const model::JointVector& start);
  void FindApproach(std::size_t motion);
  std::optional<model::JointVector> JustBefore(std::size_t motion, const model::JointVector& start);

  ProgramArm& arm_;
  const Flow& flow_;
  std::optional<model::JointVector> start_q_;
  PostureSearch search_;
  bool reads_approach_;
  std::vector<MotionEnd> ends_;
};

}  // namespace plumbline::programs
