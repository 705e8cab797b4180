#include "app/programs/correction/program_correction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "app/base/config/out_of_range.h"
#include "app/base/config/point_solutions.h"
#include "app/programs/correction/motion_path.h"
#include "app/programs/correction/path_corrector.h"
#include "app/programs/correction/point_text.h"
#include "app/programs/correction/postures.h"
#include "firmware-like/correction/code_remedy.h"
#include "firmware-like/effects/influence.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::programs {
namespace {

using model::JointVector;

/// Corrections below these leave the numbers as they are.
constexpr double kNothing_m = 1e-9, kNothing_rad = 1e-10;

Pose InBase(const Offset& offset) {
  return offset.in == Offset::In::kBase ? offset.X : Pose{};
}
Pose InTool(const Offset& offset) {
  return offset.in == Offset::In::kTool ? offset.X : Pose{};
}

}  // namespace

/// Posture at the end of a motion.
struct MotionEnd {
  std::optional<JointVector> q;     ///< nominal
  std::string unknown;              ///< why not
  JointVector last_move, approach;  ///< of the drives; empty: not known
};

class ProgramCorrector::Implementation {
 public:
  Implementation(const Brand& brand, const Program& program, const model::CellModel& cell,
                 const CorrectionSettings& settings)
      : brand_(brand),
        program_(program),
        cell_(cell),
        settings_(settings),
        corrector_(cell, settings.limits),
        contexts_(program, cell, corrector_.arm(), settings.stated),
        reads_approach_(ReadsApproach(corrector_.arm())) {}

  ProgramCorrection Correct(const ProgressFunction& progress) {
    ProgramCorrection result;
    result.flow = FlowOf(program_, settings_.entry);
    flow_ = &result.flow;
    constexpr double kPostures = 0.5;  // their share of the work
    const bool all =
        FindPostures([&](double share) { return !progress || progress(kPostures * share); });
    for (std::size_t k = 0; all && k < program_.points.size(); ++k) {
      const double share = static_cast<double>(k) / static_cast<double>(program_.points.size());
      if (progress && !progress(kPostures + (1 - kPostures) * share)) break;
      PointCorrection& point = result.points.emplace_back();
      point.point = k;
      point.reason_place = program_.points[k].place;
      CorrectPoint(program_.points[k], result.flow.uses[k], point);
    }
    flow_ = nullptr;
    return result;
  }

  void CheckSegments(const std::optional<double>& bound_m, ProgramCorrection& correction) {
    flow_ = &correction.flow;
    for (std::size_t m = 0; m < correction.flow.motions.size(); ++m) {
      CheckSegment(m, bound_m, correction);
    }
    flow_ = nullptr;
  }

 private:
  const kinematics::Chain& chain() const { return corrector_.arm().chain(); }

  static Pose TargetPose(const MotionContext& context, const Pose& X_UP, const Offset& offset) {
    return context.X_BU * InBase(offset) * X_UP * InTool(offset);
  }
  static ArmTarget ArmTargetOf(const MotionContext& context, const Pose& X_BP) {
    return {{X_BP.R * context.X_TP.R.transpose(), X_BP.p}, context.X_TP.p, context.tool};
  }

  // Postures

  Result<JointVector> JointsOf(const Point& point) const {
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
  double JointUnit(int joint) const {
    const Conventions& conventions = brand_.conventions();
    return chain().type(joint) == model::JointType::kPrismatic ? conventions.m_per_unit
                                                               : conventions.rad_per_unit;
  }

  Result<JointVector> PostureAtEnd(std::size_t m, const std::optional<JointVector>& from) {
    const MotionAt& at = flow_->motions[m];
    const Motion& motion = *at.motion;
    if (!motion.end.point) return Error{"its target is computed"};
    const Point& point = program_.points[*motion.end.point];
    if (point.kind == PointKind::kJoints) return JointsOf(point);
    if (!motion.end.offset.unknown.empty()) return Error{motion.end.offset.unknown};
    const Result<const MotionContext*> context = contexts_.Of(at, point);
    if (!context) return context.failure();
    const Result<Pose> X_UP = PoseOf(point, brand_.conventions());
    if (!X_UP) return X_UP.failure();
    std::optional<JointVector> seed = from;
    if (static_cast<int>(point.near_q.size()) == chain().size()) {
      seed = Eigen::Map<const Eigen::VectorXd>(point.near_q.data(), chain().size());
    }
    const ArmTarget target =
        ArmTargetOf(**context, TargetPose(**context, *X_UP, motion.end.offset));
    // A linear motion keeps the posture of the one before. Where that is not known, it is the one
    // in which the point was taught.
    const MotionKind obeyed = seed ? motion.kind : MotionKind::kJoint;
    const auto agrees = [&](const JointVector& q) {
      return (seed && motion.ignores_configuration) ||
             brand_.Agrees(point.configuration, chain(), q, obeyed);
    };
    return ChosenPosture(corrector_.solver(), target, agrees, !point.configuration.fields.empty(),
                         seed);
  }

  /// @return  false if `progress` ended it
  bool FindPostures(const ProgressFunction& progress) {
    ends_.assign(flow_->motions.size(), {});
    const auto known = [&](const std::optional<std::size_t>& m) -> const JointVector* {
      return m && ends_[*m].q ? &*ends_[*m].q : nullptr;
    };
    // A motion in a loop may start at a later line: those are found in the second pass.
    for (int pass = 0; pass < 2; ++pass) {
      for (std::size_t m = 0; m < ends_.size(); ++m) {
        if (!progress((pass + static_cast<double>(m) / static_cast<double>(ends_.size())) / 2)) {
          return false;
        }
        MotionEnd& end = ends_[m];
        const JointVector* const from = known(flow_->motions[m].previous);
        if (end.q || (pass == 1 && from == nullptr)) continue;
        const Result<JointVector> q =
            PostureAtEnd(m, from == nullptr ? std::nullopt : std::optional(*from));
        if (q) {
          end.q = *q;
        } else {
          end.unknown = q.error();
        }
      }
    }
    if (!reads_approach_) return true;
    for (std::size_t m = 0; m < ends_.size(); ++m) FindApproach(m);
    return true;
  }

  void FindApproach(std::size_t m) {
    MotionEnd& end = ends_[m];
    const std::optional<std::size_t>& previous = flow_->motions[m].previous;
    if (!end.q || !previous || !ends_[*previous].q) return;
    const auto before = JustBefore(m, *ends_[*previous].q);
    if (!before) return;
    constexpr double kStandstill = 1e-6;  // as in measure::ConditionsOf
    end.last_move = model::DrivePositions(chain().couplings(), *end.q - *before);
    end.approach = ends_[*previous].approach;
    if (end.approach.size() == 0) end.approach = JointVector::Zero(chain().size());
    for (int i = 0; i < chain().size(); ++i) {
      if (std::abs(end.last_move[i]) > kStandstill) end.approach[i] = end.last_move[i] > 0 ? 1 : -1;
    }
  }

  /// The joints shortly before the end of a motion, or at its start if it is joint to joint.
  std::optional<JointVector> JustBefore(std::size_t m, const JointVector& start) {
    constexpr double kShare = 0.98;
    const MotionAt& at = flow_->motions[m];
    if (at.motion->kind == MotionKind::kJoint) return start;
    const std::optional<MotionPath> path = PathOf(m, start, nullptr);
    if (!path) return std::nullopt;
    const Result<const MotionContext*> context =
        contexts_.Of(at, program_.points[*at.motion->end.point]);
    if (!context) return std::nullopt;
    return PostureNear(corrector_.solver(), ArmTargetOf(**context, path->At(kShare)), *ends_[m].q);
  }

  /// The path of the tool point in B; nullopt for a motion whose path is not known.
  /// @param corrected  null for the programmed path
  std::optional<MotionPath> PathOf(std::size_t m, const JointVector& start,
                                   const ProgramCorrection* corrected) {
    const MotionAt& at = flow_->motions[m];
    const Motion& motion = *at.motion;
    if (motion.kind != MotionKind::kLinear && motion.kind != MotionKind::kCircular) return {};
    const auto pose = [&](const Target& target) -> std::optional<Pose> {
      if (!target.point || !target.offset.unknown.empty()) return std::nullopt;
      const Point& point = program_.points[*target.point];
      const Result<const MotionContext*> context = contexts_.Of(at, point);
      if (!context) return std::nullopt;
      if (point.kind == PointKind::kJoints) {
        const Result<JointVector> q = JointsOf(point);
        if (!q) return std::nullopt;
        return corrector_.arm().UnloadedTip(*q, (*context)->tool) * (*context)->X_TP;
      }
      const Result<Pose> taught = PoseOf(point, brand_.conventions());
      if (!taught) return std::nullopt;
      const bool is_corrected =
          corrected != nullptr && corrected->points[*target.point].reason.empty();
      return TargetPose(**context,
                        is_corrected ? corrected->points[*target.point].corrected : *taught,
                        target.offset);
    };
    const std::optional<Pose> end = pose(motion.end);
    const Result<const MotionContext*> context =
        contexts_.Of(at, program_.points[*motion.end.point]);
    if (!end || !context) return std::nullopt;
    MotionPath path;
    path.start = corrector_.arm().UnloadedTip(start, (*context)->tool) * (*context)->X_TP;
    path.end = *end;
    if (motion.kind == MotionKind::kCircular) {
      const std::optional<Pose> via = motion.via ? pose(*motion.via) : std::nullopt;
      if (!via) return std::nullopt;
      path.via = via->p;
    }
    return path;
  }

  // Points

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

  std::optional<Refusal> CollectUses(const Point& point, const std::vector<PointUse>& all,
                                     Uses& uses) {
    Place first;
    for (const PointUse& use : all) {
      if (use.role == PointUse::Role::kOther && !use.reason.empty()) {
        return Refusal{use.reason, use.place};
      }
    }
    for (const PointUse& use : all) {
      if (use.role == PointUse::Role::kOther) continue;
      const MotionAt& at = flow_->motions[use.motion];
      const Motion& motion = *at.motion;
      const Target& target = use.role == PointUse::Role::kVia ? *motion.via : motion.end;
      if (!motion.special.empty()) return Refusal{motion.special, at.place};
      if (!at.reached) {
        return Refusal{"no path through the files leads to this motion", at.place};
      }
      if (!target.offset.unknown.empty()) return Refusal{target.offset.unknown, at.place};
      if (!at[Slot::kShift].known()) return Refusal{at[Slot::kShift].unknown, at.place};
      if (const auto other = OtherFrame(at, point)) return Refusal{*other, at.place};
      const Result<const MotionContext*> context = contexts_.Of(at, point);
      if (!context) return Refusal{context.error(), at.place};
      if (uses.context == nullptr) {
        uses.context = *context;
        first = at.place;
      } else if (!uses.context->Agrees(**context)) {
        return Refusal{fmt::format("used with {} at {}, and with {} at {}",
                                   ContextText(*uses.context), PlaceText(program_, first),
                                   ContextText(**context), PlaceText(program_, at.place)),
                       at.place};
      }
      uses.motions.push_back(use.motion);
      uses.targets.push_back(&target);
    }
    if (uses.motions.empty()) return Refusal{"no motion uses it", point.place};
    return std::nullopt;
  }

  static std::string ContextText(const MotionContext& context) {
    return fmt::format("{}, {}, {}", context.tool_text, context.base_text, context.load_text);
  }

  /// Why the frames that a point states are not those that execute it.
  std::optional<std::string> OtherFrame(const MotionAt& at, const Point& point) const {
    const auto differ = [](const std::map<std::string, FrameValue>& frames, const std::string& a,
                           const std::string& b) {
      if (a.empty() || b.empty() || a == b) return false;
      const auto one = frames.find(a), other = frames.find(b);
      return one == frames.end() || other == frames.end() || one->second.X.R != other->second.X.R ||
             one->second.X.p != other->second.X.p;
    };
    const SettingAt &tool = at[Slot::kTool], &base = at[Slot::kBase];
    if (tool.known() && differ(program_.tools, point.stated_tool, tool.key)) {
      return fmt::format("taught with {}, executed with {}", point.stated_tool, tool.key);
    }
    if (base.known() && differ(program_.bases, point.stated_base, base.key)) {
      return fmt::format("taught in {}, executed in {}", point.stated_base, base.key);
    }
    return std::nullopt;
  }

  void CorrectPoint(const Point& point, const std::vector<PointUse>& all, PointCorrection& result) {
    const auto refuse = [&](std::string reason) { result.reason = std::move(reason); };
    if (!point.untouchable.empty()) return refuse(point.untouchable);
    Uses uses;
    if (const auto refusal = CollectUses(point, all, uses)) {
      result.reason_place = refusal->place;
      return refuse(refusal->reason);
    }
    if (point.absolutely_accurate) {
      return refuse(
          "taught with the controller's own compensation, which a correction would double");
    }
    if (!settings_.external_axes_still) {
      for (const auto& axis : point.external_axes) {
        if (axis && axis->value != 0) {
          return refuse(
              "an external axis is not at zero, and may move the robot's base; give "
              "--external-axes-still if it does not");
        }
      }
    }
    result.context = *uses.context;
    if (point.kind == PointKind::kJoints) {
      if (!settings_.joints) return refuse("a joint target; --joints corrects these, too");
      return CorrectJoints(point, uses, result);
    }
    const Result<Pose> taught = PoseOf(point, brand_.conventions());
    if (!taught) return refuse(taught.error());
    result.taught = *taught;
    std::vector<Solved> solved;
    std::vector<const Offset*> offsets;
    for (std::size_t u = 0; u < uses.motions.size(); ++u) {
      const Offset& offset = uses.targets[u]->offset;
      const bool again = std::ranges::any_of(offsets, [&](const Offset* other) {
        return other->in == offset.in && other->X.R == offset.X.R && other->X.p == offset.X.p;
      });
      if (again) continue;
      offsets.push_back(&offset);
      Result<Solved> one = SolvePose(point, *taught, offset, uses, u);
      if (!one) {
        result.reason_place = flow_->motions[uses.motions[u]].place;
        return refuse(one.error());
      }
      solved.push_back(std::move(*one));
      const double differs_m = (solved.back().X_UP.p - solved.front().X_UP.p).norm();
      if (differs_m > settings_.offset_bound_m) {
        result.reason_place = flow_->motions[uses.motions[u]].place;
        return refuse(fmt::format(
            "used with several offsets, whose corrections differ by {:.3f} mm; give each its own "
            "point, or raise --offset-bound",
            kMmPerMetre * differs_m));
      }
    }
    WritePose(point, uses, solved.front(), *offsets.front(), result);
  }

  struct Solved {
    correction::Correction correction;
    effects::Conditions conditions;
    JointVector q_taught;
    Pose X_BP_target;
    Pose X_UP;  ///< the corrected point
    std::vector<std::string> notes;
  };

  effects::Conditions ConditionsOf(const Uses& uses, std::vector<std::string>& notes) const {
    effects::Conditions conditions =
        corrector_.ConditionsOf(uses.context->payload, settings_.utc_s, settings_.temp_C);
    if (!reads_approach_) return conditions;
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

  Result<loads::Payload> TaughtPayload(const MotionContext& context) const {
    loads::Payload payload;
    payload.tool = context.tool;
    payload.mass_kg = settings_.taught_under->mass_kg;
    const auto& cog_F =
        settings_.taught_under->cog_F ? settings_.taught_under->cog_F : cell_.payload_cog_F;
    if (payload.mass_kg > 0 && !cog_F) {
      return Error{"--taught-loaded: give the centre of gravity, too (KG,X,Y,Z in mm)"};
    }
    payload.cog_F = cog_F.value_or(Vec3::Zero());
    return payload;
  }

  static std::string CodeText(const correction::Correction& correction) {
    const std::string remedy = correction::RemedyOf(correction.code);
    return std::string(correction::Describe(correction.code)) +
           (remedy.empty() ? "" : "; " + remedy);
  }

  /// @param u  the use that it is solved for
  Result<Solved> SolvePose(const Point& point, const Pose& X_UP, const Offset& offset,
                           const Uses& uses, std::size_t u) {
    const MotionContext& context = *uses.context;
    Solved solved;
    solved.X_BP_target = TargetPose(context, X_UP, offset);
    const Result<JointVector> q = PostureOf(point, solved.X_BP_target, uses, u);
    if (!q) return q.failure();
    solved.q_taught = *q;
    solved.conditions = ConditionsOf(uses, solved.notes);
    const correction::Corrector& solver = corrector_.solver();
    ArmTarget target = ArmTargetOf(context, solved.X_BP_target);
    if (settings_.taught_under) {
      const Result<loads::Payload> taught = TaughtPayload(context);
      if (!taught) return taught.failure();
      correction::Correction landing;
      solver.PredictLanding(target.X_BP, target.p_TP, *taught, solved.conditions, *q,
                            correction::BranchSearch::kNone, landing);
      if (landing.code != correction::CorrectionCode::kOk) return Error{CodeText(landing)};
      target.X_BP = landing.X_BP_command;
      solved.X_BP_target = {target.X_BP.R * context.X_TP.R, target.X_BP.p};
    }
    correction::AssemblyPoint assembly;
    assembly.X_WP = corrector_.arm().X_WB() * target.X_BP;
    assembly.p_TP = target.p_TP;
    solver.Correct(assembly, context.payload, solved.conditions, *q,
                   correction::BranchSearch::kNone, solved.correction);
    correction::Correction& correction = solved.correction;
    if (correction.code == correction::CorrectionCode::kOk) {
      corrector_.StateRadius(context.payload, solved.conditions, target.p_TP, correction);
    }
    if (correction.code != correction::CorrectionCode::kOk) return Error{CodeText(correction)};
    // By the change of the command, so that nothing to correct changes nothing.
    const Pose command{RotationFromVector(correction.rotation_B) * solved.X_BP_target.R,
                       solved.X_BP_target.p + correction.translation_B};
    solved.X_UP = (context.X_BU * InBase(offset)).Inverse() * command * InTool(offset).Inverse();
    return solved;
  }

  Result<JointVector> PostureOf(const Point& point, const Pose& X_BP, const Uses& uses,
                                std::size_t u) {
    const std::size_t m = uses.motions[u];
    const MotionEnd& end = ends_[m];
    const bool at_end = uses.targets[u] == &flow_->motions[m].motion->end;
    if (at_end) {
      // The uses may state the posture differently well: a joint motion obeys the configuration.
      for (const std::size_t other : uses.motions) {
        const MotionAt& at = flow_->motions[other];
        if (at.motion->kind == MotionKind::kJoint && other != m && ends_[other].q &&
            at.motion->end.offset.in == uses.targets[u]->offset.in) {
          return *ends_[other].q;
        }
      }
      if (end.q) return *end.q;
      return Error{end.unknown};
    }
    // An auxiliary point is between the start and the end of its motion.
    if (!end.q) return Error{end.unknown};
    const ArmTarget target = ArmTargetOf(*uses.context, X_BP);
    return ChosenPosture(
        corrector_.solver(), target,
        [&](const JointVector& q) {
          return brand_.Agrees(point.configuration, chain(), q, MotionKind::kCircular);
        },
        !point.configuration.fields.empty(), *end.q);
  }

  void Fill(const Solved& solved, const Uses& uses, PointCorrection& result) const {
    const correction::Correction& correction = solved.correction;
    result.translation_B = correction.translation_B;
    result.rotation_rad = correction.rotation_B.norm();
    result.radius_m = correction.uncertainty_m;
    result.basis = correction.basis;
    result.extrapolated = correction.extrapolated;
    result.q_taught = solved.q_taught;
    result.q_command = correction.q;
    result.singular_value = correction.singular_value;
    result.limit = correction::NearestLimit(chain(), correction.q);
    result.target_B = solved.X_BP_target.p;
    result.notes = solved.notes;
    const bool passed = std::ranges::any_of(
        uses.motions, [&](std::size_t m) { return flow_->motions[m].motion->passes_by; });
    if (passed) result.notes.emplace_back("approximated: the robot passes by it");
    const std::string outside = config::OutOfRangeText(cell_, corrector_.arm(), correction,
                                                       uses.context->payload, solved.conditions);
    if (!outside.empty()) result.notes.push_back("outside the measured range: " + outside);
    deflection::LoadedState state;
    if (corrector_.arm().AtCommanded(correction.q, uses.context->payload, solved.conditions,
                                     state)) {
      const std::string beyond = config::BeyondLinearTheory(cell_, corrector_.arm(), state);
      if (!beyond.empty()) result.notes.push_back(beyond);
    }
  }

  /// Where the loaded tool point lands when the controller is sent to a pose; the pose itself if it
  /// cannot be computed.
  Vec3 LandingOf(const MotionContext& context, const Pose& X_BP, const JointVector& seed,
                 const effects::Conditions& conditions) const {
    const ArmTarget target = ArmTargetOf(context, X_BP);
    correction::Correction landing;
    corrector_.solver().PredictLanding(target.X_BP, target.p_TP, context.payload, conditions, seed,
                                       correction::BranchSearch::kNone, landing);
    return landing.code == correction::CorrectionCode::kOk ? landing.X_BP_command.p : X_BP.p;
  }

  void WritePose(const Point& point, const Uses& uses, const Solved& solved, const Offset& offset,
                 PointCorrection& result) {
    Fill(solved, uses, result);
    const bool nothing = result.translation_B.norm() < kNothing_m &&
                         result.rotation_rad < kNothing_rad && !settings_.taught_under;
    result.corrected = nothing ? result.taught : solved.X_UP;
    PointText text =
        TextOf(point, result.taught, result.corrected, brand_.conventions(), program_.files);
    if (!text.problem.empty()) {
      result.reason = text.problem;
      return;
    }
    const Pose exact = result.corrected;
    result.corrected = text.written;
    result.rounding_m = (text.written.p - exact.p).norm();
    result.rounding_rad = VectorFromRotation(text.written.R * exact.R.transpose()).norm();
    result.edits = std::move(text.edits);
    if (!nothing) AddConfiguration(point, result);
    const MotionContext& context = *uses.context;
    result.before_B = LandingOf(context, TargetPose(context, result.taught, offset),
                                solved.q_taught, solved.conditions);
    result.after_B = LandingOf(context, TargetPose(context, result.corrected, offset),
                               solved.correction.q, solved.conditions);
  }

  void AddConfiguration(const Point& point, PointCorrection& result) const {
    const auto& fields = point.configuration.fields;
    if (fields.empty()) return;
    const std::vector<std::string> texts =
        brand_.ConfigurationOf(point.configuration, chain(), result.q_command);
    for (std::size_t k = 0; k < fields.size() && k < texts.size(); ++k) {
      if (texts[k] == fields[k].text) continue;
      result.edits.push_back(
          {fields[k].span.file, fields[k].span.begin, fields[k].span.end, texts[k]});
      result.notes.push_back(fmt::format("{} becomes {}", fields[k].key, texts[k]));
    }
  }

  void CorrectJoints(const Point& point, const Uses& uses, PointCorrection& result) {
    const auto refuse = [&](std::string reason) { result.reason = std::move(reason); };
    const Result<JointVector> q = JointsOf(point);
    if (!q) return refuse(q.error());
    const MotionContext& context = *uses.context;
    const deflection::LoadedArm& arm = corrector_.arm();
    Solved solved;
    solved.q_taught = *q;
    solved.conditions = ConditionsOf(uses, solved.notes);
    const Pose X_BT = arm.UnloadedTip(*q, context.tool);
    solved.X_BP_target = X_BT * context.X_TP;
    result.taught = solved.X_BP_target;
    correction::AssemblyPoint assembly;
    assembly.X_WP = arm.X_WB() * Pose{X_BT.R, solved.X_BP_target.p};
    assembly.p_TP = context.X_TP.p;
    corrector_.solver().Correct(assembly, context.payload, solved.conditions, *q,
                                correction::BranchSearch::kNone, solved.correction);
    if (solved.correction.code == correction::CorrectionCode::kOk) {
      corrector_.StateRadius(context.payload, solved.conditions, context.X_TP.p, solved.correction);
    }
    if (solved.correction.code != correction::CorrectionCode::kOk) {
      return refuse(CodeText(solved.correction));
    }
    Fill(solved, uses, result);
    JointVector written = *q;
    for (int i = 0; i < chain().size(); ++i) {
      const Number& number = *point.numbers[static_cast<std::size_t>(i)];
      const double change = solved.correction.q[i] - (*q)[i];
      if (std::abs(change) < kNothing_rad) continue;
      const NumberStyle& style = chain().type(i) == model::JointType::kPrismatic
                                     ? brand_.conventions().length
                                     : brand_.conventions().angle;
      const std::string& bytes = program_.files[number.span.file].bytes;
      auto edit = NumberEdit(bytes, number, solved.correction.q[i] / JointUnit(i), style);
      if (!edit) return refuse(fmt::format("joint {} is written in an unusual way", i + 1));
      const auto value = NumberFromText(TrimmedBlanks(edit->text));
      if (value) written[i] = *value * JointUnit(i);
      AddIfChanged(bytes, std::move(*edit), result.edits);
    }
    result.corrected = arm.UnloadedTip(written, context.tool) * context.X_TP;
    const Pose exact = arm.UnloadedTip(solved.correction.q, context.tool) * context.X_TP;
    result.rounding_m = (result.corrected.p - exact.p).norm();
    result.rounding_rad = VectorFromRotation(result.corrected.R * exact.R.transpose()).norm();
    result.before_B = LandingOf(context, result.taught, *q, solved.conditions);
    result.after_B = LandingOf(context, result.corrected, written, solved.conditions);
  }

  // Segments

  /// The commanded joints at the end of a motion, after the correction.
  std::optional<JointVector> CommandedEnd(std::size_t m, const ProgramCorrection& correction) {
    const MotionEnd& end = ends_[m];
    const std::optional<std::size_t>& point = flow_->motions[m].motion->end.point;
    if (!end.q || !point) return std::nullopt;
    const PointCorrection& corrected = correction.points[*point];
    if (!corrected.reason.empty()) return end.q;
    const Offset& offset = flow_->motions[m].motion->end.offset;
    if (program_.points[*point].kind == PointKind::kJoints) return corrected.q_command;
    return PostureNear(
        corrector_.solver(),
        ArmTargetOf(corrected.context, TargetPose(corrected.context, corrected.corrected, offset)),
        *end.q);
  }

  struct Sampled {
    double ends_m = 0, largest_m = 0;
    bool complete = true;
  };

  /// Largest distance between the landing on a commanded path and the programmed one, for the share
  /// from `low` to `high` of the programmed path.
  Sampled Sample(const MotionContext& context, const effects::Conditions& conditions,
                 const MotionPath& programmed, const MotionPath& commanded, double low, double high,
                 JointVector& seed) const {
    constexpr double kStep_m = 0.05;
    constexpr int kLeast = 4, kMost = 40;
    const int count = std::clamp(
        static_cast<int>(std::ceil((high - low) * programmed.Length() / kStep_m)), kLeast, kMost);
    Sampled sampled;
    for (int k = 0; k <= count; ++k) {
      const double share = static_cast<double>(k) / count;
      const ArmTarget target = ArmTargetOf(context, commanded.At(share));
      correction::Correction landing;
      corrector_.solver().PredictLanding(target.X_BP, target.p_TP, context.payload, conditions,
                                         seed, correction::BranchSearch::kNone, landing);
      if (landing.code != correction::CorrectionCode::kOk) {
        sampled.complete = false;
        continue;
      }
      seed = landing.q;
      const double deviation_m =
          programmed.DistanceOf(landing.X_BP_command.p, low + share * (high - low));
      sampled.largest_m = std::max(sampled.largest_m, deviation_m);
      if (k == 0 || k == count) sampled.ends_m = std::max(sampled.ends_m, deviation_m);
    }
    return sampled;
  }

  void CheckSegment(std::size_t m, const std::optional<double>& bound_m,
                    ProgramCorrection& correction) {
    const MotionAt& at = flow_->motions[m];
    const Motion& motion = *at.motion;
    if (!motion.special.empty() || !at.previous || !motion.end.point || !ends_[m].q ||
        !ends_[*at.previous].q) {
      return;
    }
    // Only where both ends are corrected, the path between them should be right.
    const PointCorrection& end = correction.points[*motion.end.point];
    const auto& start_point = flow_->motions[*at.previous].motion->end.point;
    if (!end.reason.empty() || !start_point || !correction.points[*start_point].reason.empty()) {
      return;
    }
    const auto start = CommandedEnd(*at.previous, correction);
    const auto programmed = PathOf(m, *ends_[*at.previous].q, nullptr);
    if (!start || !programmed) return;
    const auto commanded = PathOf(m, *start, &correction);
    if (!commanded) return;
    SegmentDeviation segment;
    segment.motion = m;
    segment.length_m = programmed->Length();
    const effects::Conditions conditions =
        corrector_.ConditionsOf(end.context.payload, settings_.utc_s, settings_.temp_C);
    JointVector seed = *start;
    Sampled sampled = Sample(end.context, conditions, *programmed, *commanded, 0, 1, seed);
    segment.ends_m = sampled.ends_m;
    segment.largest_m = sampled.largest_m;
    if (!sampled.complete) segment.note = "parts of it are out of reach or singular";
    if (bound_m && sampled.complete && sampled.largest_m > *bound_m) {
      Refine(*bound_m, conditions, *programmed, *commanded, *start, segment, correction);
    }
    correction.segments.push_back(std::move(segment));
  }

  /// Splits a linear motion into the fewest equal parts, of 2, 4, 8.., that keep the bound.
  void Refine(double bound_m, const effects::Conditions& conditions, const MotionPath& programmed,
              const MotionPath& commanded, const JointVector& start, SegmentDeviation& segment,
              ProgramCorrection& correction) {
    constexpr int kMostParts = 64;
    const MotionAt& at = flow_->motions[segment.motion];
    const Motion& motion = *at.motion;
    if (motion.kind != MotionKind::kLinear) {
      segment.note = "only linear motions are refined";
      return;
    }
    const PointCorrection& end = correction.points[*motion.end.point];
    const Point& point = program_.points[*motion.end.point];
    if (motion.end.offset.in != Offset::In::kNone || point.kind != PointKind::kPose) {
      segment.note = "its target has an offset or is in joints: not refined";
      return;
    }
    for (int parts = 2; parts <= kMostParts; parts *= 2) {
      std::string inserted;
      MotionPath part = commanded;
      JointVector seed = start;
      double largest_m = 0;
      bool complete = true;
      for (int k = 1; k <= parts && complete; ++k) {
        const double low = static_cast<double>(k - 1) / parts,
                     high = static_cast<double>(k) / parts;
        if (k < parts) {
          const auto pose = CommandFor(end.context, programmed.At(high), conditions, seed);
          const auto numbers = pose ? NumbersOf(*pose, point) : std::nullopt;
          const auto text =
              numbers ? brand_.InsertedMotion(program_, motion, *numbers) : std::nullopt;
          if (!text) {
            segment.note = "this motion cannot be refined in its language";
            return;
          }
          inserted += *text;
          part.end = TargetPose(end.context, PoseFromNumbers(*numbers, brand_.conventions()), {});
        } else {
          part.end = commanded.end;
        }
        const Sampled sampled = Sample(end.context, conditions, programmed, part, low, high, seed);
        complete = sampled.complete;
        largest_m = std::max(largest_m, sampled.largest_m);
        part.start = part.end;
      }
      if (!complete) break;
      if (largest_m > bound_m && parts < kMostParts) continue;
      segment.inserted = parts - 1;
      segment.largest_m = largest_m;
      if (largest_m > bound_m) segment.note = "the bound is not met with 64 parts";
      correction.insertions.push_back(
          {motion.statement.file, motion.statement.begin, motion.statement.begin, inserted});
      return;
    }
    segment.note = "parts of it are out of reach or singular";
  }

  /// The command in the user frame that brings the loaded tool point to a pose in B.
  std::optional<Pose> CommandFor(const MotionContext& context, const Pose& X_BP,
                                 const effects::Conditions& conditions,
                                 const JointVector& seed) const {
    const ArmTarget target = ArmTargetOf(context, X_BP);
    correction::AssemblyPoint assembly;
    assembly.X_WP = corrector_.arm().X_WB() * target.X_BP;
    assembly.p_TP = target.p_TP;
    correction::Correction correction;
    corrector_.solver().Correct(assembly, context.payload, conditions, seed,
                                correction::BranchSearch::kNone, correction);
    if (correction.code != correction::CorrectionCode::kOk) return std::nullopt;
    return context.X_BU.Inverse() * Pose{RotationFromVector(correction.rotation_B) * X_BP.R,
                                         X_BP.p + correction.translation_B};
  }

  std::optional<std::vector<double>> NumbersOf(const Pose& X_UP, const Point& like) const {
    return NumbersOfPose(X_UP, like, brand_.conventions());
  }

  const Brand& brand_;
  const Program& program_;
  const model::CellModel& cell_;
  const CorrectionSettings& settings_;
  correction::CellCorrector corrector_;
  ContextResolver contexts_;
  bool reads_approach_;
  const Flow* flow_ = nullptr;
  std::vector<MotionEnd> ends_;
};

ProgramCorrector::ProgramCorrector(const Brand& brand, const Program& program,
                                   const model::CellModel& cell, const CorrectionSettings& settings)
    : implementation_(std::make_unique<Implementation>(brand, program, cell, settings)) {}

ProgramCorrector::~ProgramCorrector() = default;

ProgramCorrection ProgramCorrector::Correct(const ProgressFunction& progress) {
  return implementation_->Correct(progress);
}

void ProgramCorrector::CheckSegments(const std::optional<double>& bound_m,
                                     ProgramCorrection& correction) {
  implementation_->CheckSegments(bound_m, correction);
}

}  // namespace plumbline::programs
