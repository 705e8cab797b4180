#include "app/programs/correction/segments.h"

#include <algorithm>
#include <cmath>

#include "app/programs/correction/point_text.h"

namespace plumbline::programs {

using model::JointVector;

void SegmentChecker::Check(std::size_t m, const std::optional<double>& bound_m,
                           ProgramCorrection& correction) {
  const MotionAt& at = ends_.flow().motions[m];
  std::optional<SegmentDeviation> worst;
  for (const std::size_t before : at.starts) {
    auto one = CheckFrom(before, m, at.previous ? bound_m : std::nullopt, correction);
    if (one && (!worst || one->largest_m > worst->largest_m)) worst = std::move(one);
  }
  if (!worst) return;
  if (bound_m && !at.previous && worst->note.empty() && worst->largest_m > *bound_m) {
    worst->note = "it may start after several motions: not refined";
  }
  correction.segments.push_back(std::move(*worst));
}

/// The deviation during a motion after the motion `before`.
std::optional<SegmentDeviation> SegmentChecker::CheckFrom(std::size_t before, std::size_t m,
                                                          const std::optional<double>& bound_m,
                                                          ProgramCorrection& correction) {
  const MotionAt& at = ends_.flow().motions[m];
  const Motion& motion = *at.motion;
  if (!motion.special.empty() || !motion.end.point || !ends_[m].q || !ends_[before].q) return {};
  // Only where both ends are corrected, the path between them should be right.
  const PointCorrection& end = correction.points[*motion.end.point];
  const auto& start_point = ends_.flow().motions[before].motion->end.point;
  if (!end.reason.empty() || !start_point || !correction.points[*start_point].reason.empty()) {
    return std::nullopt;
  }
  const effects::Conditions conditions = arm_.ConditionsOf(end.context);
  const auto start = CommandedEnd(before, correction);
  const auto target = TargetPath(before, m, end.context, conditions);
  if (!start || !target) return std::nullopt;
  const auto commanded = CommandedPath(m, end.context, *start, correction);
  if (!commanded) return std::nullopt;
  const During during{end.context, conditions, *target, *commanded};
  SegmentDeviation segment;
  segment.motion = m;
  segment.length_m = target->Length();
  JointVector seed = *start;
  const Sampled sampled = Sample(during, *commanded, 0, 1, seed);
  segment.ends_m = sampled.ends_m;
  segment.largest_m = sampled.largest_m;
  if (!sampled.complete) segment.note = "parts of it are out of reach or singular";
  if (bound_m && sampled.complete && sampled.largest_m > *bound_m) {
    Refine(*bound_m, during, *start, segment, correction);
  }
  return segment;
}

/// The commanded joints at the end of a motion, after the correction.
std::optional<JointVector> SegmentChecker::CommandedEnd(std::size_t m,
                                                        const ProgramCorrection& correction) const {
  const Target& end = ends_.flow().motions[m].motion->end;
  if (!ends_[m].q || !end.point) return std::nullopt;
  const PointCorrection& point = correction.points[*end.point];
  if (!point.reason.empty()) return ends_[m].q;
  if (arm_.program().points[*end.point].kind == PointKind::kJoints) return point.q_command;
  const Pose X_BP = ProgramArm::StatedPose(point.context, point.corrected, end.offset);
  return PostureNear(arm_.solver(), ProgramArm::ArmTargetOf(point.context, X_BP), *ends_[m].q);
}

std::optional<MotionPath> SegmentChecker::TargetPath(std::size_t before, std::size_t m,
                                                     const MotionContext& context,
                                                     const effects::Conditions& conditions) {
  const auto target_of = [&](const Pose& stated_BP, const JointVector& seed) {
    const Result<Pose> target = arm_.TargetOf(context, stated_BP, seed, conditions);
    return target ? std::optional(*target) : std::nullopt;
  };
  const JointVector& q_start = *ends_[before].q;
  const auto start = target_of(arm_.StatedPose(context, q_start), q_start);
  if (!start) return std::nullopt;
  return ends_.PathOf(m, *start, [&](const Target& target) -> std::optional<Pose> {
    const Result<Pose> stated_BP = ends_.StatedPose(m, target);
    return stated_BP ? target_of(*stated_BP, *ends_[m].q) : std::nullopt;
  });
}

std::optional<MotionPath> SegmentChecker::CommandedPath(std::size_t m, const MotionContext& context,
                                                        const JointVector& start,
                                                        const ProgramCorrection& correction) const {
  return ends_.PathOf(m, arm_.StatedPose(context, start),
                      [&](const Target& target) -> std::optional<Pose> {
                        if (!target.point || !correction.points[*target.point].reason.empty())
                          return std::nullopt;
                        const PointCorrection& point = correction.points[*target.point];
                        if (arm_.program().points[*target.point].kind == PointKind::kJoints)
                          return point.corrected;
                        return ProgramArm::StatedPose(context, point.corrected, target.offset);
                      });
}

/// Largest distance between the landing on a commanded path and the target's, for the share from
/// `low` to `high` of the latter.
SegmentChecker::Sampled SegmentChecker::Sample(const During& during, const MotionPath& commanded,
                                               double low, double high, JointVector& seed) const {
  constexpr double kStep_m = 0.05;
  constexpr int kLeast = 4, kMost = 40;
  const int count = std::clamp(
      static_cast<int>(std::ceil((high - low) * during.target.Length() / kStep_m)), kLeast, kMost);
  Sampled sampled;
  for (int k = 0; k <= count; ++k) {
    const double share = static_cast<double>(k) / count;
    const ArmTarget sent = ProgramArm::ArmTargetOf(during.context, commanded.At(share));
    correction::Correction landing;
    arm_.solver().PredictLanding(sent.X_BP, sent.p_TP, during.context.payload, during.conditions,
                                 seed, correction::BranchSearch::kNone, landing);
    if (landing.code != correction::CorrectionCode::kOk) {
      sampled.complete = false;
      continue;
    }
    seed = landing.q;
    const double deviation_m =
        during.target.DistanceOf(landing.X_BP_command.p, low + share * (high - low));
    sampled.largest_m = std::max(sampled.largest_m, deviation_m);
    if (k == 0 || k == count) sampled.ends_m = std::max(sampled.ends_m, deviation_m);
  }
  return sampled;
}

/// Splits a linear motion into the fewest equal parts, of 2, 4, 8.., that keep the bound.
void SegmentChecker::Refine(double bound_m, const During& during, const JointVector& start,
                            SegmentDeviation& segment, ProgramCorrection& correction) const {
  constexpr int kMostParts = 64;
  const Motion& motion = *ends_.flow().motions[segment.motion].motion;
  if (motion.kind != MotionKind::kLinear) {
    segment.note = "only linear motions are refined";
    return;
  }
  const Point& point = arm_.program().points[*motion.end.point];
  if (motion.end.offset.in != Offset::In::kNone || point.kind != PointKind::kPose) {
    segment.note = "its target has an offset or is in joints: not refined";
    return;
  }
  for (int parts = 2; parts <= kMostParts; parts *= 2) {
    const double part_m = segment.length_m / parts;
    std::string inserted;
    MotionPath part = during.commanded;
    JointVector seed = start;
    double largest_m = 0;
    bool complete = true;
    for (int k = 1; k <= parts && complete; ++k) {
      const double low = static_cast<double>(k - 1) / parts, high = static_cast<double>(k) / parts;
      part.end = during.commanded.end;
      if (k < parts) {
        const Result<Command> command =
            arm_.CommandFor(during.context, during.target.At(high), seed, during.conditions);
        const auto numbers =
            command ? NumbersOfPose(ProgramArm::PointFor(during.context, command->X_BP, {}), point,
                                    arm_.brand().conventions())
                    : std::nullopt;
        const auto text =
            numbers ? arm_.brand().InsertedMotion(arm_.program(), motion, *numbers, part_m)
                    : std::nullopt;
        if (!text) {
          segment.note = "this motion cannot be refined in its language";
          return;
        }
        inserted += *text;
        part.end = ProgramArm::StatedPose(
            during.context, PoseFromNumbers(*numbers, arm_.brand().conventions()), {});
      }
      const Sampled sampled = Sample(during, part, low, high, seed);
      complete = sampled.complete;
      largest_m = std::max(largest_m, sampled.largest_m);
      part.start = part.end;
    }
    if (!complete) break;
    if (largest_m > bound_m && parts < kMostParts) continue;
    segment.inserted = parts - 1;
    segment.largest_m = largest_m;
    if (motion.passes_by)
      segment.note = "approximated: inserted motions by less than half of a part";
    if (largest_m > bound_m) segment.note = "the bound is not met with 64 parts";
    correction.insertions.push_back(
        {motion.statement.file, motion.statement.begin, motion.statement.begin, inserted});
    return;
  }
  segment.note = "parts of it are out of reach or singular";
}

}  // namespace plumbline::programs
