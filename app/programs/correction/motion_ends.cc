#include "app/programs/correction/motion_ends.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/programs/correction/path_corrector.h"
#include "app/programs/correction/point_text.h"

namespace plumbline::programs {

using model::JointVector;

namespace {

constexpr double kSamePosture = 1e-6;  // [rad] or [m]

/// Whether the controller takes the nearest posture in place of the one that the point states.
bool IgnoresPosture(const MotionAt& at) {
  const SettingAt& obeys =
      at[at.motion->kind == MotionKind::kJoint ? Slot::kObeyJoint : Slot::kObeyLinear];
  return obeys.known() && !obeys.key.empty();
}

std::string SeveralPostures(const MotionAt& at) {
  return "the ways that lead there end in several postures: " + at.previous_unknown;
}

}  // namespace

std::optional<Mat3> MotionEnds::OrientationOfEnd(std::size_t m) const {
  const std::optional<std::size_t>& end = At(m).motion->end.point;
  if (!end || arm_.program().points[*end].kind != PointKind::kPose) return std::nullopt;
  const Result<Pose> pose = PoseOf(arm_.program().points[*end], arm_.brand().conventions());
  return pose ? std::optional(pose->R) : std::nullopt;
}

Result<Pose> MotionEnds::StatedPose(std::size_t m, const Target& target) {
  if (!target.point) return Error{"its target is computed"};
  if (!target.offset.unknown.empty()) return Error{target.offset.unknown};
  const Point& point = arm_.program().points[*target.point];
  const Result<const MotionContext*> context = arm_.ContextOf(At(m), point);
  if (!context) return context.failure();
  if (point.kind == PointKind::kJoints) {
    const Result<JointVector> q = arm_.JointsOf(point);
    if (!q) return q.failure();
    return arm_.StatedPose(**context, *q);
  }
  const bool is_via = &target != &At(m).motion->end;
  const Result<Pose> X_UP = PoseOf(point, arm_.brand().conventions(),
                                   is_via ? OrientationOfEnd(m) : std::optional<Mat3>());
  if (!X_UP) return X_UP.failure();
  return ProgramArm::StatedPose(**context, *X_UP, target.offset);
}

std::optional<MotionPath> MotionEnds::PathOf(
    std::size_t m, const Pose& start,
    const std::function<std::optional<Pose>(const Target&)>& pose) const {
  const Motion& motion = *At(m).motion;
  if (motion.kind != MotionKind::kLinear && motion.kind != MotionKind::kCircular) return {};
  const std::optional<Pose> end = pose(motion.end);
  if (!end) return std::nullopt;
  MotionPath path;
  path.start = start;
  path.end = *end;
  if (motion.kind == MotionKind::kCircular) {
    const std::optional<Pose> via = motion.via ? pose(*motion.via) : std::nullopt;
    if (!via) return std::nullopt;
    path.via = via->p;
  }
  return path;
}

std::optional<MotionPath> MotionEnds::StatedPath(std::size_t m, const JointVector& start) {
  const std::optional<std::size_t>& end = At(m).motion->end.point;
  if (!end) return std::nullopt;
  const Result<const MotionContext*> context = arm_.ContextOf(At(m), arm_.program().points[*end]);
  if (!context) return std::nullopt;
  return PathOf(m, arm_.StatedPose(**context, start),
                [&](const Target& target) -> std::optional<Pose> {
                  const Result<Pose> pose = StatedPose(m, target);
                  return pose ? std::optional(*pose) : std::nullopt;
                });
}

/// The posture in which a motion starts, if it is always the same.
std::optional<JointVector> MotionEnds::StartOf(std::size_t m) const {
  const Starts starts = StartsOf(m, {});
  return starts.q.size() == 1 && !starts.unknown ? std::optional(starts.q.front()) : std::nullopt;
}

/// @param open  motions whose ends are not found yet and do not count; empty: none
MotionEnds::Starts MotionEnds::StartsOf(std::size_t m, const std::vector<bool>& open) const {
  const MotionAt& at = At(m);
  Starts starts;
  const auto add = [&](const std::optional<JointVector>& q, const std::string& why) {
    if (!q) {
      starts.unknown = true;
      starts.why = why;
      return;
    }
    const auto same = [&](const JointVector& one) {
      return (one - *q).cwiseAbs().maxCoeff() < kSamePosture;
    };
    if (std::ranges::none_of(starts.q, same)) starts.q.push_back(*q);
  };
  for (const std::size_t before : at.starts) {
    if (!open.empty() && open[before]) continue;
    add(ends_[before].q, fmt::format("the posture of the motion before, at {}, is not known",
                                     PlaceText(arm_.program(), At(before).place)));
  }
  if (at.at_start) {
    add(start_q_, at.previous_unknown + "; --start joints=Q1,Q2,.. states the joints at the start");
  } else if (at.starts.empty()) {
    add(std::nullopt, at.previous_unknown);
  }
  return starts;
}

Result<JointVector> MotionEnds::PostureAtEnd(std::size_t m, const std::optional<JointVector>& from,
                                             const std::string& no_seed) {
  const MotionAt& at = At(m);
  const Motion& motion = *at.motion;
  if (!motion.end.point) return Error{"its target is computed"};
  const Point& point = arm_.program().points[*motion.end.point];
  if (point.kind == PointKind::kJoints) return arm_.JointsOf(point);
  const Result<Pose> X_BP = StatedPose(m, motion.end);
  if (!X_BP) return X_BP.failure();
  const MotionContext& context = **arm_.ContextOf(at, point);
  const kinematics::Chain& chain = arm_.chain();
  PostureQuestion question;
  question.target = ProgramArm::ArmTargetOf(context, *X_BP);
  question.seed = from;
  if (static_cast<int>(point.near_q.size()) == chain.size()) {
    question.seed = Eigen::Map<const Eigen::VectorXd>(point.near_q.data(), chain.size());
  } else if (from) {
    if (const auto path = StatedPath(m, *from)) {
      question.along = [path = *path, &context](double share) {
        return ProgramArm::ArmTargetOf(context, path.At(share));
      };
    }
  }
  question.no_seed = no_seed;
  question.states = !point.configuration.fields.empty();
  // A linear motion keeps the posture of the one before. Where that is not known, it is the one
  // in which the point was taught.
  const MotionKind obeyed = question.seed ? motion.kind : MotionKind::kJoint;
  question.agrees = [&, obeyed](const JointVector& q) {
    return (question.seed && IgnoresPosture(at)) ||
           arm_.brand().Agrees(point.configuration, chain, q, obeyed);
  };
  return search_.Choose(question);
}

Result<JointVector> MotionEnds::PostureAtVia(std::size_t m, const Pose& X_BP) {
  const MotionEnd& end = ends_[m];
  if (!end.q) return Error{end.unknown};
  const Motion& motion = *At(m).motion;
  const Point& via = arm_.program().points[*motion.via->point];
  const MotionContext& context = **arm_.ContextOf(At(m), via);
  PostureQuestion question;
  question.target = ProgramArm::ArmTargetOf(context, X_BP);
  question.seed = end.q;
  // The arc is in one posture, so that the way to it may as well be the chord.
  question.along = [&context, chord = MotionPath{arm_.StatedPose(context, *end.q), X_BP, {}}](
                       double share) { return ProgramArm::ArmTargetOf(context, chord.At(share)); };
  question.states = !via.configuration.fields.empty();
  question.agrees = [&](const JointVector& q) {
    return IgnoresPosture(At(m)) ||
           arm_.brand().Agrees(via.configuration, arm_.chain(), q, MotionKind::kCircular);
  };
  return search_.Choose(question);
}

/// The end of a motion that may start in several postures: where these lead to several ends, it is
/// the one that the point states.
MotionEnd MotionEnds::EndFrom(std::size_t m, const Starts& starts) {
  MotionEnd end;
  if (starts.unknown || starts.q.empty()) {
    const Result<JointVector> q = PostureAtEnd(m, std::nullopt, starts.why);
    if (q) {
      end.q = *q;
    } else {
      end.unknown = q.error();
    }
    return end;
  }
  for (const JointVector& from : starts.q) {
    const Result<JointVector> q = PostureAtEnd(m, from, starts.why);
    if (!q) return {std::nullopt, q.error(), {}, {}};
    if (end.q && (*end.q - *q).cwiseAbs().maxCoeff() > kSamePosture) {
      return EndFrom(m, {{}, true, SeveralPostures(At(m))});
    }
    end.q = *q;
  }
  return end;
}

bool MotionEnds::Find(const std::function<bool(double)>& progress) {
  const std::size_t count = flow_.motions.size();
  ends_.assign(count, {});
  // A motion is open until a start of it is found: the others of a loop follow in the next pass. A
  // motion whose end a further start contradicts is decided for good, so that the passes end.
  std::vector<bool> open(count, true), decided(count, false);
  std::vector<Starts> used(count);
  bool changed = true;
  for (int pass = 0; changed; ++pass) {
    changed = false;
    for (std::size_t m = 0; m < count; ++m) {
      const double share = static_cast<double>(m) / static_cast<double>(count);
      if (!progress(pass == 0 ? share : 1.0)) return false;
      const Starts starts = StartsOf(m, open);
      if (decided[m] || (starts.q.empty() && !starts.unknown)) continue;
      if (!open[m] && starts.q.size() == used[m].q.size() && starts.unknown == used[m].unknown) {
        continue;
      }
      MotionEnd end = EndFrom(m, starts);
      const bool differs =
          ends_[m].q && (!end.q || (*end.q - *ends_[m].q).cwiseAbs().maxCoeff() > kSamePosture);
      if (differs) {
        decided[m] = true;
        end = EndFrom(m, {{}, true, SeveralPostures(At(m))});
      }
      open[m] = false;
      used[m] = starts;
      ends_[m] = std::move(end);
      changed = true;
    }
    // A loop that nothing enters.
    for (std::size_t m = 0; m < count && !changed; ++m) {
      if (!open[m]) continue;
      open[m] = false;
      ends_[m] = EndFrom(m, {{}, true, At(m).previous_unknown});
      changed = true;
    }
  }
  for (std::size_t m = 0; reads_approach_ && m < count; ++m) FindApproach(m);
  return true;
}

void MotionEnds::FindApproach(std::size_t m) {
  MotionEnd& end = ends_[m];
  const std::optional<JointVector> start = StartOf(m);
  if (!end.q || !start) return;
  const auto before = JustBefore(m, *start);
  if (!before) return;
  constexpr double kStandstill = 1e-6;  // as in measure::ConditionsOf
  const kinematics::Chain& chain = arm_.chain();
  end.last_move = model::DrivePositions(chain.couplings(), *end.q - *before);
  if (At(m).previous) end.approach = ends_[*At(m).previous].approach;
  if (end.approach.size() == 0) end.approach = JointVector::Zero(chain.size());
  for (int i = 0; i < chain.size(); ++i) {
    if (std::abs(end.last_move[i]) > kStandstill) end.approach[i] = end.last_move[i] > 0 ? 1 : -1;
  }
}

/// The joints shortly before the end of a motion, or at its start if it is joint to joint.
std::optional<JointVector> MotionEnds::JustBefore(std::size_t m, const JointVector& start) {
  constexpr double kShare = 0.98;
  const Motion& motion = *At(m).motion;
  if (motion.kind == MotionKind::kJoint) return start;
  const std::optional<MotionPath> path = StatedPath(m, start);
  if (!path) return std::nullopt;
  const MotionContext& context = **arm_.ContextOf(At(m), arm_.program().points[*motion.end.point]);
  return PostureNear(arm_.solver(), ProgramArm::ArmTargetOf(context, path->At(kShare)),
                     *ends_[m].q);
}

}  // namespace plumbline::programs
