// Correction of the points of a program.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/programs/correction/motion_ends.h"

namespace plumbline::programs {

/// Corrects points in the contexts of their uses. The arguments must outlive the object.
class PointCorrector {
 public:
  PointCorrector(ProgramArm& arm, MotionEnds& ends) : arm_(arm), ends_(ends) {}

  /// @param point  index in Program::points
  PointCorrection Correct(std::size_t point);

 private:
  struct Refusal {
    std::string reason;
    Place place;
  };
  /// The motions that use a point, if all agree.
  struct Uses {
    const MotionContext* context = nullptr;
    std::vector<std::size_t> motions;
    std::vector<const Target*> targets;
  };
  /// The correction for one of the uses.
  struct Solved {
    const Offset* offset = nullptr;
    Pose taught, corrected;  ///< of the point, in its base
    Pose stated_BP, target_BP;
    Command command;
    effects::Conditions conditions;
    model::JointVector q_taught;
    std::vector<std::string> notes;
  };

  const MotionAt& At(std::size_t motion) const { return ends_.flow().motions[motion]; }
  std::optional<Refusal> RefusalOf(const Point& point, const PointUse& use);
  std::optional<Refusal> CollectUses(const Point& point, const std::vector<PointUse>& all,
                                     Uses& uses);
  std::optional<std::string> OtherFrame(const MotionAt& at, const Point& point) const;
  std::string MovedByExternalAxes(const Point& point) const;
  effects::Conditions ConditionsOf(const Uses& uses, std::vector<std::string>& notes) const;
  Result<model::JointVector> PostureOf(const Uses& uses, std::size_t use, const Pose& X_BP);
  Result<Solved> SolvePose(const Point& point, const Uses& uses, std::size_t use);
  Result<void> Solve(const MotionContext& context, Solved& solved);

  void CorrectPose(const Point& point, const Uses& uses, PointCorrection& result);
  void CorrectJoints(const Point& point, const Uses& uses, PointCorrection& result);
  void Fill(const Solved& solved, const Uses& uses, PointCorrection& result) const;
  void WritePose(const Point& point, const Uses& uses, const std::vector<Solved>& solved,
                 PointCorrection& result) const;
  void AddConfiguration(const Point& point, PointCorrection& result) const;

  ProgramArm& arm_;
  MotionEnds& ends_;
};

/// The end and the auxiliary point of an arc are corrected together or not at all: one alone would
/// bend the arc by the whole correction. An arc that starts at a point without a correction is
/// noted.
void KeepArcsWhole(const Program& program, const Flow& flow, std::vector<PointCorrection>& points);

}  // namespace plumbline::programs
