#include "app/programs/correction/path_corrector.h"

#include <cmath>

#include "app/programs/correction/postures.h"
#include "firmware-like/correction/code_remedy.h"
#include "firmware-like/correction/point_posture.h"
#include "firmware-like/effects/written.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::programs {

bool ReadsApproach(const deflection::LoadedArm& arm) {
  const model::JointVector zero = model::JointVector::Zero(arm.size());
  const effects::Conditions at = arm.ConditionsAt(zero, {});
  effects::Conditions moved = at;
  moved.approach = model::JointVector::Ones(arm.size());
  moved.last_move = 0.1 * moved.approach;
  // Not LoadedArm::EffectsAt(), where effects fade with the distance from the fitted rows.
  effects::Influence<double> still, approached;
  effects::AddEffects(arm.effects(), at, still);
  effects::AddEffects(arm.effects(), moved, approached);
  for (int entry = 0; entry < effects::Influence<double>::kSize; ++entry) {
    if (still[entry] != approached[entry]) return true;
  }
  return false;
}

PathCorrector::PathCorrector(const model::CellModel& cell,
                             const correction::CorrectionLimits& limits, Options options)
    : corrector_(cell, limits),
      options_(std::move(options)),
      reads_approach_(ReadsApproach(corrector_.arm())),
      last_(options_.near_q) {}

/// The joints to which a parabola through those of the last rows leads.
model::JointVector PathCorrector::Extrapolated() const {
  if (!actual_[0]) return *last_;
  if (!actual_[1]) return *actual_[0];
  if (!actual_[2]) return 2 * *actual_[0] - *actual_[1];
  return 3 * (*actual_[0] - *actual_[1]) + *actual_[2];
}

/// Actual minus commanded joints. They change so little from row to row that one evaluation near
/// them is enough.
const model::JointVector& PathCorrector::SagNear(const PathRow& row,
                                                 const effects::Conditions& conditions,
                                                 const model::JointVector& q) {
  if (sag_.size() == 0) sag_ = model::JointVector::Zero(q.size());
  deflection::LoadedState state;
  arm().AtActual(q + sag_, row.payload, conditions, state);
  sag_ = state.sag;
  return sag_;
}

/// Keeps the actual joints of a corrected row, from which the next row's are extrapolated.
void PathCorrector::Remember(const model::JointVector& actual, const model::JointVector& sag) {
  sag_ = sag;
  actual_[2] = actual_[1];
  actual_[1] = actual_[0];
  actual_[0] = actual;
}

bool PathCorrector::FindPosture(const PathRow& row, const Pose& X_BT, CorrectedRow& corrected,
                                model::JointVector& q) const {
  const ArmTarget target{X_BT, Vec3::Zero(), row.payload.tool};
  const std::optional<model::JointVector>& seed = row.q ? row.q : last_;
  PostureQuestion question;
  question.target = target;
  question.seed = seed;
  const Result<model::JointVector> found = PostureSearch(corrector_.solver()).Choose(question);
  corrected.searched = true;
  if (!found) {
    corrected.problem = found.error();
    return false;
  }
  q = *found;
  return true;
}

void PathCorrector::SetApproach(const model::JointVector& q, effects::Conditions& conditions) {
  if (!last_) return;
  constexpr double kStandstill = 1e-6;  // as in measure::ConditionsOf
  conditions.last_move = model::DrivePositions(corrector_.arm().chain().couplings(), q - *last_);
  if (approach_.size() == 0) approach_ = model::JointVector::Zero(q.size());
  for (int i = 0; i < q.size(); ++i) {
    if (std::abs(conditions.last_move[i]) > kStandstill) {
      approach_[i] = conditions.last_move[i] > 0 ? 1 : -1;
    }
  }
  conditions.approach = approach_;
}

void PathCorrector::StateRadius(const PathRow& row, const effects::Conditions& conditions,
                                CorrectedRow& corrected) {
  correction::Correction& correction = corrected.correction;
  const bool near = stated_ && (correction.q - stated_->q).cwiseAbs().maxCoeff() <= kRadiusMove &&
                    stated_->payload.mass_kg == row.payload.mass_kg &&
                    stated_->payload.cog_F == row.payload.cog_F &&
                    stated_->payload.tool == row.payload.tool &&
                    stated_->payload.item == row.payload.item && stated_->temp_C == row.temp_C &&
                    stated_->extrapolated == correction.extrapolated;
  if (!near) {
    corrector_.StateRadius(row.payload, conditions, Vec3::Zero(), correction);
    stated_ = Stated{correction.q,     row.payload,
                     row.temp_C,       correction.uncertainty_m,
                     correction.basis, correction.extrapolated};
  }
  correction.uncertainty_m = stated_->radius_m;
  correction.basis = stated_->basis;
}

void PathCorrector::Correct(const PathRow& row, CorrectedRow& corrected) {
  using correction::CorrectionCode;
  corrected.problem.clear();
  corrected.searched = false;
  correction::Correction& correction = corrected.correction;
  correction.code = CorrectionCode::kPending;
  const deflection::LoadedArm& arm = corrector_.arm();
  const Pose X_BT = row.X_BT ? *row.X_BT : arm.UnloadedTip(*row.q, row.payload.tool);
  effects::Conditions conditions = corrector_.ConditionsOf(row.payload, options_.utc_s, row.temp_C);
  if (row.t_s) conditions.t_s = row.t_s;
  correction::AssemblyPoint point;
  point.X_WP = arm.X_WB() * X_BT;

  // The start of the iteration: the row's joints, else those to which the rows before lead.
  model::JointVector q;
  const bool exact = row.q && !row.X_BT;
  bool have = false;
  if (exact) {
    q = *row.q;
    have = true;
  } else if (reads_approach_ || !last_) {
    if (last_) {
      if (const auto near = PostureNear(corrector_.solver(), {X_BT, Vec3::Zero(), row.payload.tool},
                                        row.q ? *row.q : *last_)) {
        q = *near;
        have = true;
      }
    }
    if (!have && !FindPosture(row, X_BT, corrected, q)) return;
    have = true;
  } else {
    q = row.q ? *row.q : Extrapolated();
  }
  if (reads_approach_) SetApproach(q, conditions);
  const correction::Corrector& solver = corrector_.solver();
  solver.Correct(point, row.payload, conditions, q, correction::BranchSearch::kNone, correction);
  // A path that jumps may lead to another branch: then the nearest posture is searched.
  const auto jumped = [&] {
    if (exact || correction.code != CorrectionCode::kOk || !last_) return false;
    const correction::JointDistance farthest =
        correction::FarthestFromTaught(arm.chain(), *last_, correction.q);
    return correction::IsOtherPosture(arm.chain(), farthest);
  };
  if (!have && (correction.code == CorrectionCode::kUnreachable ||
                correction.code == CorrectionCode::kJointLimit || jumped())) {
    if (!FindPosture(row, X_BT, corrected, q)) return;
    solver.Correct(point, row.payload, conditions, q, correction::BranchSearch::kNone, correction);
  }
  if (correction.code == CorrectionCode::kOk && options_.radius) {
    StateRadius(row, conditions, corrected);
  }
  if (correction.code != CorrectionCode::kOk) {
    const std::string remedy = correction::RemedyOf(correction.code);
    corrected.problem =
        std::string(correction::Describe(correction.code)) + (remedy.empty() ? "" : "; " + remedy);
    actual_ = {};
    if (have) last_ = q;
    return;
  }
  corrected.X_BT_command = {RotationFromVector(correction.rotation_B) * X_BT.R,
                            X_BT.p + correction.translation_B};
  last_ = reads_approach_ || exact ? q : correction.q;
  if (reads_approach_ || exact) return;
  if (correction.iterations == 0) {
    Remember(q, q - correction.q);
  } else {
    Remember(correction.q + SagNear(row, conditions, correction.q), sag_);
  }
}

}  // namespace plumbline::programs
