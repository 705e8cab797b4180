// The arm that executes a program: poses, targets and commands of its tool point.
#pragma once

#include "app/programs/correction/postures.h"
#include "app/programs/correction/program_correction.h"

namespace plumbline::programs {

/// A corrected command.
struct Command {
  correction::Correction correction;
  Pose X_BP;  ///< where the controller is sent [m]
};

/// What a code means, and what to do.
std::string CodeText(const correction::Correction& correction);

/// The cell's corrector, with the conventions of a brand. The arguments must outlive the object.
class ProgramArm {
 public:
  ProgramArm(const Brand& brand, const Program& program, const model::CellModel& cell,
             const CorrectionSettings& settings)
      : brand_(brand),
        program_(program),
        cell_(cell),
        settings_(settings),
        corrector_(cell, settings.limits),
        contexts_(program, cell, corrector_.arm(), settings.stated) {}

  const Brand& brand() const { return brand_; }
  const Program& program() const { return program_; }
  const model::CellModel& cell() const { return cell_; }
  const CorrectionSettings& settings() const { return settings_; }
  correction::CellCorrector& corrector() { return corrector_; }
  const correction::Corrector& solver() const { return corrector_.solver(); }
  const deflection::LoadedArm& arm() const { return corrector_.arm(); }
  const kinematics::Chain& chain() const { return corrector_.arm().chain(); }

  /// @return  owned by this object
  Result<const MotionContext*> ContextOf(const MotionAt& at, const Point& point) {
    return contexts_.Of(at, point);
  }
  /// For the robot at standstill, without a direction of approach.
  effects::Conditions ConditionsOf(const MotionContext& context) const {
    return corrector_.ConditionsOf(context.payload, settings_.utc_s, settings_.temp_C);
  }

  /// Pose of the tool point in B that the numbers of a point and an offset state.
  static Pose StatedPose(const MotionContext& context, const Pose& X_UP, const Offset& offset);
  /// The point from which the same offset leads to a pose in B: the inverse of StatedPose().
  static Pose PointFor(const MotionContext& context, const Pose& X_BP, const Offset& offset);
  /// Pose of the unloaded tool point in B.
  Pose StatedPose(const MotionContext& context, const model::JointVector& q) const {
    return arm().UnloadedTip(q, context.tool) * context.X_TP;
  }
  static ArmTarget ArmTargetOf(const MotionContext& context, const Pose& X_BP) {
    return {{X_BP.R * context.X_TP.R.transpose(), X_BP.p}, context.X_TP.p, context.tool};
  }

  /// Where the loaded tool point shall be: where it is stated, or, if the program was taught under
  /// a load, where that load brought it. Every target of a correction comes from here.
  /// @param seed  joints near the stated pose
  Result<Pose> TargetOf(const MotionContext& context, const Pose& stated_BP,
                        const model::JointVector& seed,
                        const effects::Conditions& conditions) const;

  /// The command that brings the loaded tool point to a target in B.
  Result<Command> CommandFor(const MotionContext& context, const Pose& target_BP,
                             const model::JointVector& seed,
                             const effects::Conditions& conditions) const;

  /// Where the loaded tool point lands when the controller is sent to a pose; the pose itself if it
  /// cannot be computed.
  Vec3 LandingOf(const MotionContext& context, const Pose& X_BP, const model::JointVector& seed,
                 const effects::Conditions& conditions) const;

  /// Of a point in joints [rad] or [m].
  Result<model::JointVector> JointsOf(const Point& point) const;
  /// In rad or m.
  double JointUnit(int joint) const;

 private:
  Result<loads::Payload> TaughtPayload(const MotionContext& context) const;

  const Brand& brand_;
  const Program& program_;
  const model::CellModel& cell_;
  const CorrectionSettings& settings_;
  correction::CellCorrector corrector_;
  ContextResolver contexts_;
};

}  // namespace plumbline::programs
