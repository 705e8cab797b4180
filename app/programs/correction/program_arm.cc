#include "app/programs/correction/program_arm.h"

#include <fmt/format.h>

#include "firmware-like/correction/code_remedy.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::programs {
namespace {

using model::JointVector;

Pose InBase(const Offset& offset) {
  return offset.in == Offset::In::kBase ? offset.X : Pose{};
}
Pose InTool(const Offset& offset) {
  return offset.in == Offset::In::kTool ? offset.X : Pose{};
}

}  // namespace

std::string CodeText(const correction::Correction& correction) {
  const std::string remedy = correction::RemedyOf(correction.code);
  return std::string(correction::Describe(correction.code)) + (remedy.empty() ? "" : "; " + remedy);
}

Pose ProgramArm::StatedPose(const MotionContext& context, const Pose& X_UP, const Offset& offset) {
  return context.X_BU * InBase(offset) * X_UP * InTool(offset);
}

Pose ProgramArm::PointFor(const MotionContext& context, const Pose& X_BP, const Offset& offset) {
  return (context.X_BU * InBase(offset)).Inverse() * X_BP * InTool(offset).Inverse();
}

Result<loads::Payload> ProgramArm::TaughtPayload(const MotionContext& context) const {
  const StatedPayload& stated = *settings_.taught_under;
  loads::Payload payload;
  payload.tool = context.tool;
  payload.mass_kg = stated.mass_kg;
  const auto& cog_F = stated.cog_F ? stated.cog_F : cell_.payload_cog_F;
  if (payload.mass_kg > 0 && !cog_F) {
    return Error{"--taught-loaded: give the centre of gravity, too (KG,X,Y,Z in mm)"};
  }
  payload.cog_F = cog_F.value_or(Vec3::Zero());
  return payload;
}

Result<Pose> ProgramArm::TargetOf(const MotionContext& context, const Pose& stated_BP,
                                  const JointVector& seed,
                                  const effects::Conditions& conditions) const {
  if (!settings_.taught_under) return stated_BP;
  const Result<loads::Payload> taught = TaughtPayload(context);
  if (!taught) return taught.failure();
  const ArmTarget stated = ArmTargetOf(context, stated_BP);
  correction::Correction landing;
  solver().PredictLanding(stated.X_BP, stated.p_TP, *taught, conditions, seed,
                          correction::BranchSearch::kNone, landing);
  if (landing.code != correction::CorrectionCode::kOk) return Error{CodeText(landing)};
  return Pose{landing.X_BP_command.R * context.X_TP.R, landing.X_BP_command.p};
}

Result<Command> ProgramArm::CommandFor(const MotionContext& context, const Pose& target_BP,
                                       const JointVector& seed,
                                       const effects::Conditions& conditions) const {
  const ArmTarget target = ArmTargetOf(context, target_BP);
  correction::AssemblyPoint assembly;
  assembly.X_WP = arm().X_WB() * target.X_BP;
  assembly.p_TP = target.p_TP;
  Command command;
  correction::Correction& correction = command.correction;
  solver().Correct(assembly, context.payload, conditions, seed, correction::BranchSearch::kNone,
                   correction);
  if (correction.code != correction::CorrectionCode::kOk) return Error{CodeText(correction)};
  // By the change of the command, so that nothing to correct changes nothing.
  command.X_BP = {RotationFromVector(correction.rotation_B) * target_BP.R,
                  target_BP.p + correction.translation_B};
  return command;
}

Vec3 ProgramArm::LandingOf(const MotionContext& context, const Pose& X_BP, const JointVector& seed,
                           const effects::Conditions& conditions) const {
  const ArmTarget target = ArmTargetOf(context, X_BP);
  correction::Correction landing;
  solver().PredictLanding(target.X_BP, target.p_TP, context.payload, conditions, seed,
                          correction::BranchSearch::kNone, landing);
  return landing.code == correction::CorrectionCode::kOk ? landing.X_BP_command.p : X_BP.p;
}

Result<JointVector> ProgramArm::JointsOf(const Point& point) const {
  JointVector q(chain().size());
  if (static_cast<int>(point.numbers.size()) < q.size()) {
    return Error{fmt::format("it has {} joints, the cell {}", point.numbers.size(), q.size())};
  }
  for (int i = 0; i < q.size(); ++i) {
    const auto& number = point.numbers[static_cast<std::size_t>(i)];
    if (!number) return Error{fmt::format("joint {} is not written", i + 1)};
    q[i] = number->value * JointUnit(i);
  }
  return q;
}

double ProgramArm::JointUnit(int joint) const {
  const Conventions& conventions = brand_.conventions();
  return chain().type(joint) == model::JointType::kPrismatic ? conventions.m_per_unit
                                                             : conventions.rad_per_unit;
}

}  // namespace plumbline::programs
