#include "app/programs/correction/point_correction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "app/base/config/out_of_range.h"
#include "app/base/config/point_solutions.h"
#include "app/programs/correction/point_text.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::programs {
namespace {

using model::JointVector;

/// Corrections below these leave the numbers as they are.
constexpr double kNothing_m = 1e-9, kNothing_rad = 1e-8;

std::string ContextText(const MotionContext& context) {
  return fmt::format("{}, {}, {}", context.tool_text, context.base_text, context.load_text);
}

bool SameOffset(const Offset& a, const Offset& b) {
  return a.in == b.in && a.X.R == b.X.R && a.X.p == b.X.p;
}

double AngleBetween(const Mat3& a, const Mat3& b) {
  return VectorFromRotation(a * b.transpose()).norm();
}

const Target& TargetOf(const Motion& motion, PointUse::Role role) {
  return role == PointUse::Role::kVia ? *motion.via : motion.end;
}

}  // namespace

// The uses

std::optional<PointCorrector::Refusal> PointCorrector::RefusalOf(const Point& point,
                                                                 const PointUse& use) {
  const MotionAt& at = At(use.motion);
  const Offset& offset = TargetOf(*at.motion, use.role).offset;
  if (!at.motion->special.empty()) return Refusal{at.motion->special, at.place};
  if (!at.reached) return Refusal{"no path through the files leads to this motion", at.place};
  if (!offset.unknown.empty()) return Refusal{offset.unknown, at.place};
  if (!at[Slot::kShift].known()) return Refusal{at[Slot::kShift].unknown, at.place};
  if (const auto other = OtherFrame(at, point)) return Refusal{*other, at.place};
  return std::nullopt;
}

std::optional<PointCorrector::Refusal> PointCorrector::CollectUses(const Point& point,
                                                                   const std::vector<PointUse>& all,
                                                                   Uses& uses) {
  for (const PointUse& use : all) {
    if (use.role == PointUse::Role::kOther && !use.reason.empty()) {
      return Refusal{use.reason, use.place};
    }
  }
  Place first;
  for (const PointUse& use : all) {
    if (use.role == PointUse::Role::kOther) continue;
    if (auto refusal = RefusalOf(point, use)) return refusal;
    const MotionAt& at = At(use.motion);
    const Result<const MotionContext*> context = arm_.ContextOf(at, point);
    if (!context) return Refusal{context.error(), at.place};
    if (uses.context == nullptr) {
      uses.context = *context;
      first = at.place;
    } else if (!uses.context->Agrees(**context)) {
      return Refusal{fmt::format("used with {} at {}, and with {} at {}",
                                 ContextText(*uses.context), PlaceText(arm_.program(), first),
                                 ContextText(**context), PlaceText(arm_.program(), at.place)),
                     at.place};
    }
    uses.motions.push_back(use.motion);
    uses.targets.push_back(&TargetOf(*at.motion, use.role));
  }
  if (uses.motions.empty()) return Refusal{"no motion uses it", point.place};
  return std::nullopt;
}

/// Why the frames that a point states are not those that execute it.
std::optional<std::string> PointCorrector::OtherFrame(const MotionAt& at,
                                                      const Point& point) const {
  const auto differ = [](const std::map<std::string, FrameValue>& frames, const std::string& a,
                         const std::string& b) {
    if (a.empty() || b.empty() || a == b) return false;
    const auto one = frames.find(a), other = frames.find(b);
    return one == frames.end() || other == frames.end() || one->second.X.R != other->second.X.R ||
           one->second.X.p != other->second.X.p;
  };
  const SettingAt &tool = at[Slot::kTool], &base = at[Slot::kBase];
  if (tool.known() && differ(arm_.program().tools, point.stated_tool, tool.key)) {
    return fmt::format("taught with {}, executed with {}", point.stated_tool, tool.key);
  }
  if (base.known() && differ(arm_.program().bases, point.stated_base, base.key)) {
    return fmt::format("taught in {}, executed in {}", point.stated_base, base.key);
  }
  return std::nullopt;
}

std::string PointCorrector::MovedByExternalAxes(const Point& point) const {
  const bool moved = std::ranges::any_of(point.external_axes,
                                         [](const auto& axis) { return axis && axis->value != 0; });
  if (!moved || arm_.settings().external_axes_still) return "";
  return "an external axis is not at zero, and may move the robot's base; give "
         "--external-axes-still if it does not";
}

PointCorrection PointCorrector::Correct(std::size_t index) {
  const Point& point = arm_.program().points[index];
  PointCorrection result;
  result.point = index;
  result.reason_place = point.place;
  result.reason = point.untouchable;
  if (!result.reason.empty()) return result;
  Uses uses;
  if (const auto refusal = CollectUses(point, ends_.flow().uses[index], uses)) {
    result.reason_place = refusal->place;
    result.reason = refusal->reason;
  } else if (point.absolutely_accurate) {
    result.reason =
        "taught with the controller's own compensation, which a correction would double";
  } else {
    result.reason = MovedByExternalAxes(point);
  }
  if (!result.reason.empty()) return result;
  result.context = *uses.context;
  if (point.kind == PointKind::kPose) {
    CorrectPose(point, uses, result);
  } else if (arm_.settings().joints) {
    CorrectJoints(point, uses, result);
  } else {
    result.reason = "a joint target; --joints corrects these, too";
  }
  return result;
}

// Poses

void PointCorrector::CorrectPose(const Point& point, const Uses& uses, PointCorrection& result) {
  std::vector<Solved> solved;
  for (std::size_t u = 0; u < uses.motions.size(); ++u) {
    const auto refuse = [&](std::string reason) {
      result.reason_place = At(uses.motions[u]).place;
      result.reason = std::move(reason);
    };
    const bool again = !StatesPositionAlone(point) && std::ranges::any_of(solved, [&](auto& one) {
      return SameOffset(*one.offset, uses.targets[u]->offset);
    });
    if (again) continue;
    Result<Solved> one = SolvePose(point, uses, u);
    if (!one) return refuse(one.error());
    solved.push_back(std::move(*one));
    const double differs_m = (solved.back().corrected.p - solved.front().corrected.p).norm();
    if (differs_m > arm_.settings().offset_bound_m) {
      return refuse(
          fmt::format("used with several offsets, whose corrections differ by {:.3f} mm; give each "
                      "its own point, or raise --offset-bound",
                      kMmPerMetre * differs_m));
    }
  }
  WritePose(point, uses, solved, result);
}

effects::Conditions PointCorrector::ConditionsOf(const Uses& uses,
                                                 std::vector<std::string>& notes) const {
  effects::Conditions conditions = arm_.ConditionsOf(*uses.context);
  if (!ends_.reads_approach()) return conditions;
  const MotionEnd& first = ends_[uses.motions.front()];
  const bool same = std::ranges::all_of(uses.motions, [&](std::size_t m) {
    return ends_[m].approach.size() > 0 && ends_[m].approach == first.approach &&
           (ends_[m].last_move - first.last_move).cwiseAbs().maxCoeff() < 1e-6;
  });
  if (same) {
    conditions.approach = first.approach;
    conditions.last_move = first.last_move;
  } else {
    notes.emplace_back(
        "the direction of approach is not known or differs between its uses: effects that depend "
        "on it are left out");
  }
  return conditions;
}

Result<JointVector> PointCorrector::PostureOf(const Uses& uses, std::size_t u, const Pose& X_BP) {
  const std::size_t m = uses.motions[u];
  if (uses.targets[u] != &At(m).motion->end) return ends_.PostureAtVia(m, X_BP);
  // The uses may state the posture differently well: a joint motion obeys the configuration.
  for (const std::size_t other : uses.motions) {
    const Motion& motion = *At(other).motion;
    if (motion.kind == MotionKind::kJoint && other != m && ends_[other].q &&
        motion.end.offset.in == uses.targets[u]->offset.in) {
      return *ends_[other].q;
    }
  }
  if (ends_[m].q) return *ends_[m].q;
  return Error{ends_[m].unknown};
}

Result<void> PointCorrector::Solve(const MotionContext& context, Solved& solved) {
  const Result<Pose> target =
      arm_.TargetOf(context, solved.stated_BP, solved.q_taught, solved.conditions);
  if (!target) return target.failure();
  solved.target_BP = *target;
  Result<Command> command = arm_.CommandFor(context, *target, solved.q_taught, solved.conditions);
  if (!command) return command.failure();
  solved.command = std::move(*command);
  correction::Correction& correction = solved.command.correction;
  arm_.corrector().StateRadius(context.payload, solved.conditions, context.X_TP.p, correction);
  if (correction.code != correction::CorrectionCode::kOk) return Error{CodeText(correction)};
  return {};
}

Result<PointCorrector::Solved> PointCorrector::SolvePose(const Point& point, const Uses& uses,
                                                         std::size_t u) {
  const MotionContext& context = *uses.context;
  const std::size_t m = uses.motions[u];
  const bool is_via = uses.targets[u] != &At(m).motion->end;
  const Result<Pose> taught = PoseOf(point, arm_.brand().conventions(),
                                     is_via ? ends_.OrientationOfEnd(m) : std::optional<Mat3>());
  if (!taught) return taught.failure();
  Solved solved;
  solved.offset = &uses.targets[u]->offset;
  solved.taught = *taught;
  solved.stated_BP = ProgramArm::StatedPose(context, *taught, *solved.offset);
  const Result<JointVector> q = PostureOf(uses, u, solved.stated_BP);
  if (!q) return q.failure();
  solved.q_taught = *q;
  solved.conditions = ConditionsOf(uses, solved.notes);
  if (const Result<void> done = Solve(context, solved); !done) return done.failure();
  solved.corrected = ProgramArm::PointFor(context, solved.command.X_BP, *solved.offset);
  return solved;
}

void PointCorrector::Fill(const Solved& solved, const Uses& uses, PointCorrection& result) const {
  const correction::Correction& correction = solved.command.correction;
  result.taught = solved.taught;
  result.translation_B = solved.command.X_BP.p - solved.stated_BP.p;
  result.rotation_rad = AngleBetween(solved.command.X_BP.R, solved.stated_BP.R);
  result.radius_m = correction.uncertainty_m;
  result.basis = correction.basis;
  result.extrapolated = correction.extrapolated;
  result.q_taught = solved.q_taught;
  result.q_command = correction.q;
  result.singular_value = correction.singular_value;
  result.limit = correction::NearestLimit(arm_.chain(), correction.q);
  result.target_B = solved.target_BP.p;
  result.notes = solved.notes;
  const loads::Payload& payload = uses.context->payload;
  const bool passed =
      std::ranges::any_of(uses.motions, [&](std::size_t m) { return At(m).motion->passes_by; });
  if (passed) result.notes.emplace_back("approximated: the robot passes by it");
  const std::string outside =
      config::OutOfRangeText(arm_.cell(), arm_.arm(), correction, payload, solved.conditions);
  if (!outside.empty()) result.notes.push_back("outside the measured range: " + outside);
  deflection::LoadedState state;
  if (arm_.arm().AtCommanded(correction.q, payload, solved.conditions, state)) {
    const std::string beyond = config::BeyondLinearTheory(arm_.cell(), arm_.arm(), state);
    if (!beyond.empty()) result.notes.push_back(beyond);
  }
}

void PointCorrector::WritePose(const Point& point, const Uses& uses,
                               const std::vector<Solved>& solved, PointCorrection& result) const {
  const Solved& first = solved.front();
  Fill(first, uses, result);
  const bool nothing =
      result.translation_B.norm() < kNothing_m && result.rotation_rad < kNothing_rad;
  const Pose exact = nothing ? result.taught : first.corrected;
  PointText text =
      TextOf(point, result.taught, exact, arm_.brand().conventions(), arm_.program().files);
  if (!text.problem.empty()) {
    result.reason = text.problem;
    return;
  }
  result.corrected = text.written;
  result.rounding_m = (text.written.p - exact.p).norm();
  result.rounding_rad = AngleBetween(text.written.R, exact.R);
  result.edits = std::move(text.edits);
  if (!nothing) AddConfiguration(point, result);
  // Of several uses, the one that the numbers written suit least.
  double largest_m = -1;
  for (const Solved& one : solved) {
    const auto landing = [&](Pose X_UP, const JointVector& q) {
      if (StatesPositionAlone(point)) X_UP.R = one.corrected.R;
      return arm_.LandingOf(*uses.context, ProgramArm::StatedPose(*uses.context, X_UP, *one.offset),
                            q, one.conditions);
    };
    const Vec3 after_B = landing(result.corrected, one.command.correction.q);
    const double after_m = (after_B - one.target_BP.p).norm();
    if (after_m <= largest_m) continue;
    largest_m = after_m;
    result.target_B = one.target_BP.p;
    result.after_B = after_B;
    result.before_B = landing(result.taught, one.q_taught);
  }
}

/// Only what the correction changes: a field that a motion does not obey may say anything.
void PointCorrector::AddConfiguration(const Point& point, PointCorrection& result) const {
  const auto& fields = point.configuration.fields;
  if (fields.empty()) return;
  const auto texts_at = [&](const JointVector& q) {
    return arm_.brand().ConfigurationOf(point.configuration, arm_.chain(), q);
  };
  const std::vector<std::string> before = texts_at(result.q_taught),
                                 after = texts_at(result.q_command);
  for (std::size_t k = 0; k < fields.size() && k < before.size() && k < after.size(); ++k) {
    if (before[k] == after[k] || after[k] == fields[k].text) continue;
    result.edits.push_back(
        {fields[k].span.file, fields[k].span.begin, fields[k].span.end, after[k]});
    result.notes.push_back(fmt::format("{} becomes {}", fields[k].key, after[k]));
  }
}

// Joints

void PointCorrector::CorrectJoints(const Point& point, const Uses& uses, PointCorrection& result) {
  const auto refuse = [&](std::string reason) { result.reason = std::move(reason); };
  const Result<JointVector> q = arm_.JointsOf(point);
  if (!q) return refuse(q.error());
  const MotionContext& context = *uses.context;
  Solved solved;
  solved.q_taught = *q;
  solved.conditions = ConditionsOf(uses, solved.notes);
  solved.taught = solved.stated_BP = arm_.StatedPose(context, *q);
  if (const Result<void> done = Solve(context, solved); !done) return refuse(done.error());
  const JointVector& command = solved.command.correction.q;
  Fill(solved, uses, result);
  JointVector written = *q;
  for (int i = 0; i < arm_.chain().size(); ++i) {
    const Number& number = *point.numbers[static_cast<std::size_t>(i)];
    if (std::abs(command[i] - (*q)[i]) < kNothing_rad) continue;
    const NumberStyle& style = arm_.chain().type(i) == model::JointType::kPrismatic
                                   ? arm_.brand().conventions().length
                                   : arm_.brand().conventions().angle;
    const std::string& bytes = arm_.program().files[number.span.file].bytes;
    auto edit = NumberEdit(bytes, number, command[i] / arm_.JointUnit(i), style);
    if (!edit) return refuse(fmt::format("joint {} is written in an unusual way", i + 1));
    const auto value = NumberFromText(TrimmedBlanks(edit->text));
    if (value) written[i] = *value * arm_.JointUnit(i);
    AddIfChanged(bytes, std::move(*edit), result.edits);
  }
  const Pose exact = arm_.StatedPose(context, command);
  result.corrected = arm_.StatedPose(context, written);
  result.rounding_m = (result.corrected.p - exact.p).norm();
  result.rounding_rad = AngleBetween(result.corrected.R, exact.R);
  result.before_B = arm_.LandingOf(context, result.taught, *q, solved.conditions);
  result.after_B = arm_.LandingOf(context, result.corrected, written, solved.conditions);
}

// Arcs

void KeepArcsWhole(const Program& program, const Flow& flow, std::vector<PointCorrection>& points) {
  const auto corrected = [&](const Target& target) {
    return target.point && points[*target.point].reason.empty();
  };
  const auto name = [&](const Target& target) {
    if (!target.point) return "the computed " + target.computed;
    const std::string& of_point = program.points[*target.point].name;
    return of_point.empty() ? std::string("the other") : of_point;
  };
  std::deque<std::size_t> arcs;
  for (std::size_t m = 0; m < flow.motions.size(); ++m) arcs.push_back(m);
  while (!arcs.empty()) {
    const MotionAt& at = flow.motions[arcs.front()];
    arcs.pop_front();
    const Motion& motion = *at.motion;
    if (!motion.via || corrected(*motion.via) == corrected(motion.end)) continue;
    const bool via = corrected(*motion.via);
    const Target &kept = via ? *motion.via : motion.end, &left = via ? motion.end : *motion.via;
    PointCorrection& point = points[*kept.point];
    point.reason = fmt::format(
        "the end and the auxiliary point of an arc are corrected together, and {} stays as it is",
        name(left));
    point.reason_place = at.place;
    for (const PointUse& use : flow.uses[*kept.point]) {
      if (use.role != PointUse::Role::kOther) arcs.push_back(use.motion);
    }
  }
  for (const MotionAt& at : flow.motions) {
    if (!at.motion->via || !at.motion->end.point) continue;
    for (const std::size_t before : at.starts) {
      const Target& start = flow.motions[before].motion->end;
      if (!start.point || corrected(start) == corrected(at.motion->end)) continue;
      PointCorrection& point = points[corrected(start) ? *start.point : *at.motion->end.point];
      point.notes.push_back(
          fmt::format("the arc at {} is corrected at one end only, which changes its shape",
                      PlaceText(program, at.place)));
    }
  }
}

}  // namespace plumbline::programs
