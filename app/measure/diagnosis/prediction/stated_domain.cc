#include "app/measure/diagnosis/prediction/stated_domain.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "app/measure/diagnosis/critics/misfit.h"
#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/fit_problem.h"
#include "app/measure/diagnosis/linear/linearisation.h"
#include "app/measure/diagnosis/prediction/covariance_share.h"
#include "app/measure/diagnosis/prediction/residual_spread.h"
#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/diagnosis/validation/farthest_poses.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/kinematics/pose_distance.h"

namespace plumbline::measure {
namespace {

// Directions in which the fitted rows load the joints that yield.

/// Poses that must load a joint in one direction before the rows show how it yields in it.
constexpr int kMinPosesPerDirection = 5;

using I = effects::Influence<double>;

/// How one joint yields over the fitted rows.
struct JointInRows {
  std::map<ClusterIndex, double> torques;  ///< of each pose, the largest of its visits
  /// Largest over the rows: displacement of the tip per unit of torque, and by a gap [m].
  double per_torque_m = 0, by_gap_m = 0;
};

/// The torque that moves the tip by the noise; 0 if a gap alone does.
double LeastTorque(const JointInRows& joint, double sigma_m) {
  if (joint.by_gap_m >= sigma_m) return 0;
  return joint.per_torque_m > 0 ? sigma_m / joint.per_torque_m : HUGE_VAL;
}

/// The range of the torques; nullopt if enough poses load the joint in both directions, or if none
/// moves the tip by the noise.
std::optional<model::Interval> OneDirection(const JointInRows& joint, double sigma_m) {
  constexpr double kCountedShare = 0.1;   // of the largest torque
  constexpr double kRoundedShare = 1e-3;  // of the largest torque: a balanced joint
  constexpr double kLeastLoad = 1e-3;     // N m or N: below it, a torque is a rounding error
  double low = 0, high = 0;
  for (const auto& [pose, tau] : joint.torques) {
    low = std::min(low, tau);
    high = std::max(high, tau);
  }
  const double largest = std::max(-low, high);
  const double least = std::max(LeastTorque(joint, sigma_m), kRoundedShare * largest);
  if (!(largest > std::max(least, kLeastLoad))) return std::nullopt;
  const double counted = std::max(least, kCountedShare * largest);
  int positive = 0, negative = 0;
  for (const auto& [pose, tau] : joint.torques) {
    positive += tau >= counted ? 1 : 0;
    negative += -tau >= counted ? 1 : 0;
  }
  const bool shown = positive >= kMinPosesPerDirection;
  const bool reverse_shown = negative >= kMinPosesPerDirection;
  if (shown && reverse_shown) return std::nullopt;
  model::Interval range{std::min(low, -least), std::max(high, least)};
  if (shown) range.low = -least;
  if (reverse_shown) range.high = least;
  return range;
}

/// Adds what one row shows of every joint.
void AddRow(const deflection::LoadedArm& arm, const I& influence,
            const deflection::LoadedState& state, ClusterIndex pose,
            std::vector<JointInRows>& joints) {
  kinematics::Jacobian jacobian;
  arm.chain().JacobianAt(state.posture, state.X_BT.p, jacobian);
  for (int i = 0; i < arm.size(); ++i) {
    if (!arm.loads().known(i)) continue;
    JointInRows& joint = joints[i];
    const double tau = state.tau[i], lever = jacobian.col(i).head<3>().norm();
    const double slope = arm.compliance(i) + influence.Joint(I::kCompliance, i) -
                         influence.Joint(I::kHardening, i) * tau * tau;
    joint.per_torque_m = std::max(joint.per_torque_m, std::abs(slope) * lever);
    joint.by_gap_m = std::max(joint.by_gap_m, std::abs(influence.Joint(I::kLoadGap, i)) * lever);
    double& largest = joint.torques[pose];
    if (std::abs(tau) > std::abs(largest)) largest = tau;
  }
}

/// Each joint that yields to its gravity torque tau by
///   s(tau) = c tau - hardening tau^3 + gap sign(tau)
/// as declared or by the effects of `model`, and that fewer than kMinPosesPerDirection poses load
/// in one of the two directions. A pose counts in a direction if its torque is at least a tenth of
/// the largest and moves the tip by at least the noise. The range goes from the torque that moves
/// the tip by the noise, in the direction that was not shown, to the largest torque in the other.
/// Rejected rows do not count. Joints that never move the tip by the noise are left out, and so are
/// those whose gravity torque is unknown because a link mass is not declared.
/// @param suspected  0-based joints of which a rival of the answer depends on the direction of the
///                   load: they count as if a gap moved the tip
std::vector<model::JointLoad> JointLoadsOf(const FitProblem& problem, const Model& model,
                                           const std::set<int>& suspected) {
  const Dataset& data = problem.data;
  Indexed<SessionIndex, deflection::LoadedArm> arms;  // gravity in the base depends on its frame
  for (const SessionIndex session : data.sessions.indices())
    arms.emplace_back(CellOf(data, model, session));
  std::vector<JointInRows> joints(static_cast<std::size_t>(arms.front().size()));
  for (const int joint : suspected) joints[joint].by_gap_m = HUGE_VAL;
  deflection::LoadedState state;
  for (const RowIndex row : data.row_indices()) {
    if (problem.weights[row] < kOutlierWeight || data.numbers[row].count == 0) continue;
    const deflection::LoadedArm& arm = arms[data.session_of[row]];
    const effects::Conditions& moment = data.conditions[row];
    I influence = arm.EffectsAt(moment);
    effects::AddEffects(model.effects, moment, influence);
    if (!arm.AtCommanded(data.measured(row).q, data.payloads[row], &influence, moment.tau, state))
      continue;
    state.X_BT = arm.X_WB().Inverse() * state.X_WT;
    AddRow(arm, influence, state, data.cluster_of[row], joints);
  }
  std::vector<model::JointLoad> loads;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (const auto range = OneDirection(joints[i], problem.sigma_m))
      loads.push_back({static_cast<int>(i), *range});
  }
  return loads;
}

// Combinations of joints that moved only together, whose effects the rows cannot separate.

/// One row per accepted pose, however often it was visited; all joints.
Eigen::MatrixXd AcceptedAngles(const FitProblem& problem) {
  const int joints = problem.data.cell.robot.size();
  Eigen::MatrixXd angles(problem.data.rows(), joints);
  Eigen::Index count = 0;
  std::set<ClusterIndex> visited;
  for (const RowIndex row : problem.data.row_indices()) {
    if (problem.weights[row] < kOutlierWeight) continue;
    if (!visited.insert(problem.data.cluster_of[row]).second) continue;
    angles.row(count++) = problem.data.measured(row).q.transpose();
  }
  return angles.topRows(count);
}

/// Standard deviation [rad]; 0 for a prismatic joint and for one that hardly moved.
Eigen::VectorXd Spreads(const model::Robot& robot, const Eigen::MatrixXd& deviations) {
  constexpr double kMinSpread_rad = 0.02;
  Eigen::VectorXd spreads =
      (deviations.colwise().squaredNorm() / static_cast<double>(deviations.rows())).cwiseSqrt();
  for (int joint = 0; joint < robot.size(); ++joint) {
    const model::JointType type = robot.joints[joint].type;
    if (type == model::JointType::kPrismatic || spreads[joint] < kMinSpread_rad) spreads[joint] = 0;
  }
  return spreads;
}

model::JointCombination CombinationAlong(const Eigen::VectorXd& weights,
                                         const Eigen::MatrixXd& angles) {
  constexpr double kMargin_rad = 0.02;
  const Eigen::VectorXd sums = angles * weights;
  return {weights, {sums.minCoeff() - kMargin_rad, sums.maxCoeff() + kMargin_rad}};
}

/// The joints that take part in a combination, e.g. "q2 and q3".
std::string JointsText(const model::JointCombination& combination) {
  constexpr double kTakesPart = 0.15;
  std::vector<std::string> joints;
  for (Eigen::Index k = 0; k < combination.weights.size(); ++k) {
    if (std::abs(combination.weights[k]) > kTakesPart) joints.push_back(fmt::format("q{}", k + 1));
  }
  return Listed(joints);
}

/// The combinations of joint angles that hardly varied over the rows that were not rejected:
/// eigenvectors of the correlation matrix of the revolute joints with an eigenvalue below 0.05.
/// Joints that move independently leave none: the smallest eigenvalue then is about
/// (1 - sqrt(joints / poses))^2 [Marchenko & Pastur 1967], 0.18 with the fewest poses accepted,
/// three per joint; with fewer the result is empty. Joints that hardly moved are left out.
/// @return  weights per radian and ranges [rad], each widened by 0.02 rad to both sides
std::vector<model::JointCombination> NearlyConstantCombinations(const FitProblem& problem) {
  constexpr double kNearlyConstant = 0.05;  // eigenvalue
  constexpr int kRowsPerJoint = 3;
  const Eigen::MatrixXd angles = AcceptedAngles(problem);
  const Eigen::Index joints = angles.cols();
  if (angles.rows() < kRowsPerJoint * joints) return {};
  const Eigen::MatrixXd deviations = angles.rowwise() - angles.colwise().mean();
  const Eigen::VectorXd spreads = Spreads(problem.data.cell.robot, deviations);
  // A joint without spread gets the eigenvalue 1 of its own, and takes part in no other.
  const Eigen::VectorXd scales =
      (spreads.array() > 0).select(spreads.array().max(1e-12).inverse(), 0);
  const Eigen::MatrixXd standard = deviations * scales.asDiagonal();
  Eigen::MatrixXd correlations =
      standard.transpose() * standard / static_cast<double>(angles.rows());
  for (Eigen::Index k = 0; k < joints; ++k) correlations(k, k) = 1;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(correlations);
  std::vector<model::JointCombination> combinations;
  for (Eigen::Index k = 0; k < joints && eigen.eigenvalues()[k] < kNearlyConstant; ++k) {
    const Eigen::VectorXd weights = eigen.eigenvectors().col(k).cwiseProduct(scales);
    combinations.push_back(CombinationAlong(weights.normalized(), angles));
  }
  return combinations;
}

/// What these combinations mean for poses that move the joints apart; nullopt if there are none.
std::optional<std::string> MovedTogetherNote(
    const std::vector<model::JointCombination>& combinations) {
  if (combinations.empty()) return std::nullopt;
  std::vector<std::string> joints;
  for (const model::JointCombination& combination : combinations) {
    joints.push_back(JointsText(combination));
  }
  return fmt::format(
      "joints moved together in the measured poses ({}): poses that move them apart are outside "
      "the measured range; if the robot works at such poses, measure some",
      fmt::join(joints, "; "));
}

// Validity domain of a corrected model and the frames of its sessions.

/// The lowest and highest load if all rows are at two distinct loads; otherwise empty. Three loads
/// at least a tenth of their range apart can reveal a deflection that is not proportional to the
/// load.
std::vector<double> FewPayloadLevels(const FitProblem& problem) {
  if (!problem.data.loads_recorded()) return {};
  constexpr double kApart = 0.1;
  std::vector<double> loads_kg, levels_kg;
  for (const RowIndex row : problem.data.row_indices()) {
    if (problem.weights[row] < kOutlierWeight) continue;
    loads_kg.push_back(problem.data.conditions[row].payload_kg);
  }
  std::ranges::sort(loads_kg);
  if (loads_kg.empty()) return {};
  const double range_kg = loads_kg.back() - loads_kg.front();
  for (const double load_kg : loads_kg) {
    if (levels_kg.empty() || load_kg - levels_kg.back() >= std::max(kApart * range_kg, 1e-9)) {
      levels_kg.push_back(load_kg);
    }
  }
  return levels_kg.size() == 2 ? std::vector<double>{loads_kg.front(), loads_kg.back()}
                               : std::vector<double>{};
}

/// Adds to `diagnosis` the estimated frames of each session, if the cell leaves them free, and the
/// range covered by the rows that were not rejected.
void AddFramesAndDomain(const FitProblem& problem, const Model& model, Diagnosis& diagnosis) {
  const Dataset& data = problem.data;
  if (data.frames_free() || data.tip_free()) {
    for (const SessionIndex session : data.sessions.indices()) {
      model::SessionFrames frames;
      frames.id = data.sessions[session].empty() ? "1" : data.sessions[session];
      frames.X_WB = model.frames[session].X_WB;
      if (data.tip_free()) frames.tip_F = model.frames[session].tip_F;
      diagnosis.sessions.push_back(frames);
    }
  }
  model::Domain& domain = diagnosis.domain;
  const auto widen = [](model::Interval& interval, double value) {
    interval.low = std::min(interval.low, value);
    interval.high = std::max(interval.high, value);
  };
  std::set<int> tools, items;
  for (const RowIndex index : data.row_indices()) {
    if (problem.weights[index] < kOutlierWeight) continue;
    const MeasuredRow& row = data.measured(index);
    const double load_kg = data.conditions[index].payload_kg;
    if (domain.q.empty()) {
      for (const double q : row.q) domain.q.push_back({q, q});
      if (data.loads_recorded()) domain.payload_kg = model::Interval{load_kg, load_kg};
      if (row.temp_C) domain.temp_C = model::Interval{*row.temp_C, *row.temp_C};
    }
    for (std::size_t i = 0; i < domain.q.size(); ++i)
      widen(domain.q[i], row.q[static_cast<int>(i)]);
    if (domain.payload_kg) widen(*domain.payload_kg, load_kg);
    if (data.cell.tool.number) tools.insert(*data.cell.ToolAt(data.payloads[index].tool).number);
    items.insert(data.payloads[index].item);
    if (domain.temp_C) widen(*domain.temp_C, *row.temp_C);
  }
  domain.tools.assign(tools.begin(), tools.end());
  if (!data.cell.payload_items.empty()) domain.payload_items.emplace(items.begin(), items.end());
  domain.combinations = NearlyConstantCombinations(problem);
  domain.payload_levels_kg = FewPayloadLevels(problem);
}

// Difference between an answer and its rivals at new points, where no row decides between them.

/// Standard deviation on one axis of the difference between the answer and its rivals at a distance
/// d from the measured poses: sqrt(near_m^2 + (distant_m d)^2).
struct RivalSpread {
  double near_m = 0, distant_m = 0;
};

/// Variance of one axis between the answer and the rival with the largest tip displacement [m^2].
/// Used for ranges, which do not test this difference: explanations that agree along the wire may
/// differ across it.
double VarianceBetweenRivals(const Diagnosis& diagnosis) {
  double most_m2 = 0;
  for (const Rival& rival : diagnosis.rivals) {
    double sum_m2 = 0;
    for (const Vec3& shift_W : rival.shift_W) sum_m2 += shift_W.squaredNorm() / 3;
    const double rows = static_cast<double>(std::max<std::size_t>(1, rival.shift_W.size()));
    most_m2 = std::max(most_m2, sum_m2 / rows);
  }
  return most_m2;
}

/// Least squares fit of the squared differences, both terms at least 0. On the rows the
/// explanations agree, so held-out rows do not show how they differ elsewhere; between the points
/// of a grid they may differ however near these are.
/// @param from  distance from the measured poses
/// @param axes  measured lengths per row: 3, or 1 for ranges
RivalSpread SpreadOfRivals(const std::vector<RivalSeparation>& separations,
                           const kinematics::PoseDistance& from, double axes) {
  double n = 0, sum_x = 0, sum_xx = 0, sum_y = 0, sum_xy = 0;
  for (const RivalSeparation& at : separations) {
    const double x = std::pow(from.Of(at.q), 2), y = at.distance_m * at.distance_m / axes;
    n += 1, sum_x += x, sum_xx += x * x, sum_y += y, sum_xy += x * y;
  }
  if (n == 0) return {};
  const double spread = n * sum_xx - sum_x * sum_x;
  const double slope = spread > 0 ? (n * sum_xy - sum_x * sum_y) / spread : 0;
  const double intercept = (sum_y - slope * sum_x) / n;
  if (slope < 0) return {std::sqrt(sum_y / n), 0};
  if (intercept < 0) return {0, sum_xx > 0 ? std::sqrt(sum_xy / sum_xx) : 0};
  return {std::sqrt(intercept), std::sqrt(slope)};
}

/// The problem in which rows that the model does not fit have no weight.
FitProblem WithoutMisfit(FitProblem problem, const std::optional<Misfit>& misfit) {
  if (!misfit || !misfit->outside_domain) return problem;
  for (const RowIndex row : problem.weights.indices()) {
    if (Meets(misfit->condition, problem.data, row)) problem.weights[row] = 0;
  }
  return problem;
}

/// Joints of rivals that depend on their gravity torque, 0-based.
std::set<int> LoadedJointsOf(const std::vector<Rival>& rivals, int joints) {
  std::set<int> found;
  for (const Rival& rival : rivals) {
    const effects::Effect* effect = effects::FindEffect(rival.id);
    if (effect == nullptr || !effect->traits().Needs(effects::Signal::kTorques, rival.word))
      continue;
    for (int joint = 0; joint < joints; ++joint) {
      const std::string name = fmt::format("q{}", joint + 1);
      if (std::ranges::find(rival.scope, name) != rival.scope.end()) found.insert(joint);
    }
  }
  return found;
}

/// Adds notes on directions of load that the rows do not show, or that are not known.
void AddLoadNotes(const std::vector<effects::ActiveEffect>& found, bool weight_known,
                  const std::vector<model::JointLoad>& loads, Diagnosis& diagnosis) {
  if (!loads.empty()) {
    std::vector<std::string> joints;
    joints.reserve(loads.size());
    for (const model::JointLoad& load : loads) joints.push_back(fmt::format("q{}", load.joint + 1));
    diagnosis.notes.push_back(fmt::format(
        "too few poses load {} in one of the two directions to show how the joint yields there: "
        "points that load it that way by more than the noise are outside [domain]",
        Listed(joints, "or")));
  }
  const bool unknown_loads =
      !weight_known && std::ranges::any_of(found, [](const effects::ActiveEffect& effect) {
        const effects::EffectTraits& traits = effect.term.effect->traits();
        return traits.Needs(effects::Signal::kNoTorques, effect.term.word) ||
               traits.Needs(effects::Signal::kTorques, effect.term.word);
      });
  if (!unknown_loads) return;
  diagnosis.notes.emplace_back(
      "link_mass_kg is not declared for every link, so that the directions in which these rows "
      "load "
      "the joints are not known: points that load a joint in a direction that no row shows count "
      "as "
      "measured, with a radius that is too small if it yields differently there. Declare the "
      "masses");
}

/// A correction fades with the distance from the measured poses unless its causes are confirmed:
/// between rivals, or with a doubt, they are not.
Correction CorrectionOf(const Diagnosis& diagnosis) {
  if (!diagnosis.withheld.empty()) return Correction::kNone;
  const bool open =
      diagnosis.verdict == Verdict::kUnknown || diagnosis.verdict == Verdict::kAmbiguous;
  const bool confirmed = !open && diagnosis.discrepancy.empty();
  return confirmed ? Correction::kWritten : Correction::kFading;
}

/// Adds the frames of the declared model, which replace those of the sessions as a correction
/// fades.
void AddDeclaredFrames(const Dataset& data, const Model& declared, Diagnosis& diagnosis) {
  for (std::size_t k = 0; k < diagnosis.sessions.size(); ++k) {
    model::SessionFrames& frames = diagnosis.sessions[k];
    const Model::Frames& of_declared = declared.frames[SessionIndex(static_cast<int>(k))];
    frames.X_WB_declared = of_declared.X_WB;
    if (data.tip_free()) frames.tip_declared_F = of_declared.tip_F;
  }
}

/// Adds the expected residuals of new points, near the measured poses and far from them. Rivals
/// count as errors of the correction, so that one which fades does so sooner.
void AddSpread(const Task& task, const Identified& found, const Model& declared,
               const PerRow<double>& weights, const CorrectedModel& corrected,
               Diagnosis& diagnosis) {
  auto spread = SpreadOf(corrected.validation, found.fit, CorrectionOf(diagnosis));
  if (!spread) return;
  if (!task.data.instrument_used() && !diagnosis.not_observable.empty()) {
    // Held-out rows on artefacts cannot show errors in directions that no row observes.
    diagnosis.notes.emplace_back(
        "the radius of new points is not validated by these rows: all are on artefacts, which "
        "cannot "
        "show every error of the tip (not_observable). Measure some positions with an instrument");
    return;
  }
  if (task.data.ranges()) {
    spread->near_m = std::hypot(spread->near_m, std::sqrt(VarianceBetweenRivals(diagnosis)));
  }
  FitRows accepted;
  for (const RowIndex row : task.data.row_indices()) {
    if (weights[row] >= kOutlierWeight) accepted.push_back(row);
  }
  const model::CellModel cell = CellOf(task.data, corrected.model, SessionIndex(0));
  const std::vector<model::JointVector> poses = StoredPoses(cell, task.data, accepted);
  const kinematics::PoseDistance from = DistanceFrom(cell, poses);
  const RivalSpread rivals =
      SpreadOfRivals(diagnosis.rival_separations, from, task.data.lengths_per_row());
  spread->near_m = std::hypot(spread->near_m, rivals.near_m);
  spread->distant_m = std::hypot(spread->distant_m, rivals.distant_m);
  diagnosis.domain.residual_sigma_m = spread->near_m;
  diagnosis.domain.covariance_share = CovarianceShare(found, corrected.discrepancy_parameters);
  // Half a turn away, where d is 2, it would add less than 0.5 %.
  constexpr double kNegligible = 0.05;
  if (spread->distant_m < kNegligible * spread->near_m) return;
  diagnosis.domain.distant_sigma_m = spread->distant_m;
  diagnosis.domain.poses = poses;
  if (!spread->declared_m) return;
  diagnosis.domain.declared_sigma_m = spread->declared_m;
  diagnosis.domain.reach_rad = ReachOf(from, task.data, accepted);
  AddDeclaredFrames(task.data, declared, diagnosis);
}

/// Length of the largest residual of the rows that are not outliers.
double LargestResidual(const PerRow<Vec3>& errors, const PerRow<double>& weights) {
  double largest_m = 0;
  for (const RowIndex row : errors.indices()) {
    if (weights[row] >= kOutlierWeight) largest_m = std::max(largest_m, errors[row].norm());
  }
  return largest_m;
}

}  // namespace

void AddDomain(const Task& task, const Identified& found, const FittedModel& declared,
               const FitOfAllRows& fit, const CorrectedModel& corrected, Diagnosis& diagnosis) {
  const FitProblem validated = WithoutMisfit(fit.problem, diagnosis.misfit);
  AddFramesAndDomain(validated, corrected.model, diagnosis);
  diagnosis.domain.joint_loads = JointLoadsOf(
      validated, corrected.model, LoadedJointsOf(diagnosis.rivals, task.data.cell.robot.size()));
  AddLoadNotes(corrected.model.effects, task.data.weight_known, diagnosis.domain.joint_loads,
               diagnosis);
  diagnosis.domain.largest_residual_m = LargestResidual(declared.errors, fit.problem.weights);
  AddSpread(task, found, declared.model, validated.weights, corrected, diagnosis);
  const std::size_t rejected = diagnosis.outlier_rows.size(), rows = fit.problem.weights.size();
  if (diagnosis.domain.residual_sigma_m &&
      static_cast<double>(rejected) > kOutsideRadius * static_cast<double>(rows)) {
    diagnosis.notes.push_back(
        fmt::format("{} of {} rows are rejected as outliers, more than a 95 % radius may exclude: "
                    "the radius is widened to include them; find out what they have in common",
                    rejected, rows));
  }
  if (const auto note = MovedTogetherNote(diagnosis.domain.combinations)) {
    diagnosis.notes.push_back(*note);
  }
  const std::optional<double> cell_zero_s = TimeZeroOf(task.data.cell);
  diagnosis.domain.time_zero_s = cell_zero_s ? cell_zero_s : task.options.time_zero_s;
}

}  // namespace plumbline::measure
