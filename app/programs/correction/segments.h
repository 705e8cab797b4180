// The loaded tool's path between corrected points.
#pragma once

#include <optional>

#include "app/programs/correction/motion_ends.h"

namespace plumbline::programs {

/// Compares the path between corrected points with the one that shall be: between the targets of
/// the corrections, straight or on the arc. The arguments must outlive the object.
class SegmentChecker {
 public:
  SegmentChecker(ProgramArm& arm, MotionEnds& ends) : arm_(arm), ends_(ends) {}

  /// Adds the deviation during a motion, if both its ends are corrected: the largest, if it may
  /// start after several others.
  /// @param bound_m  splits a linear motion with one start into parts until its deviation is below;
  ///                 absent: none
  void Check(std::size_t motion, const std::optional<double>& bound_m,
             ProgramCorrection& correction);

 private:
  struct Sampled {
    double ends_m = 0, largest_m = 0;
    bool complete = true;
  };
  /// What holds during a motion.
  struct During {
    const MotionContext& context;
    effects::Conditions conditions;
    MotionPath target;     ///< of the loaded tool point
    MotionPath commanded;  ///< of the controller
  };

  std::optional<model::JointVector> CommandedEnd(std::size_t motion,
                                                 const ProgramCorrection& correction) const;
  std::optional<SegmentDeviation> CheckFrom(std::size_t before, std::size_t motion,
                                            const std::optional<double>& bound_m,
                                            ProgramCorrection& correction);
  std::optional<MotionPath> TargetPath(std::size_t before, std::size_t motion,
                                       const MotionContext& context,
                                       const effects::Conditions& conditions);
  std::optional<MotionPath> CommandedPath(std::size_t motion, const MotionContext& context,
                                          const model::JointVector& start,
                                          const ProgramCorrection& correction) const;
  Sampled Sample(const During& during, const MotionPath& commanded, double low, double high,
                 model::JointVector& seed) const;
  void Refine(double bound_m, const During& during, const model::JointVector& start,
              SegmentDeviation& segment, ProgramCorrection& correction) const;

  ProgramArm& arm_;
  MotionEnds& ends_;
};

}  // namespace plumbline::programs
