// Nonlinear refit: identifiable parameters, rows of several kinds, and covariances.
#include "app/measure/diagnosis/linear/refit.h"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>

#include "app/measure/diagnosis/linear/alignment.h"
#include "app/measure/diagnosis/linear/candidate_set.h"
#include "app/measure/diagnosis/linear/robust.h"
#include "app/measure/diagnosis/linear/shape_search.h"
#include "app/measure/diagnosis/prediction/covariance_share.h"
#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/geometry/rotation.h"
#include "tests/app/measure/diagnosis/simulated.h"

namespace plumbline::refit_test {

using namespace plumbline::measure;

TEST_CASE("a parameter that the rows do not determine is not identifiable, others are") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 40 --seed 3");
  const Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
  REQUIRE(dataset);
  FitProblem problem = UnitWeightFit(*dataset, 1);
  problem.sigma_m = 5e-5;
  // The first joint rotates about the z axis of the base, so its offset is a yaw of the base.
  const auto of = [&](const std::vector<std::pair<std::string, double>>& frame) {
    Model model = Model::Declared(*dataset);
    model.effects = {EffectWith(data.cell, "joint_offset", {{"q1", 1e-6}, {"q3", 1e-6}}),
                     EffectWith(data.cell, "base_frame", frame)};
    const Result<Refit> refit = RefitModel(problem, model, {});
    REQUIRE(refit);
    REQUIRE(refit->identifiable.size() == 3);
    return refit->identifiable;
  };
  CHECK(of({{"yaw", 1e-6}}) == std::vector<bool>{false, true, false});
  CHECK(of({{"z", 1e-6}}) == std::vector<bool>{true, true, true});
}

TEST_CASE("poses, positions and rows without a measurement are fitted together") {
  constexpr double kSigma_m = 5e-5, kSigma_rad = 1e-4, kOffset_rad = 1e-3;
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 45 --repeats 0 --seed 3");
  const effects::ActiveEffect offset = EffectWith(data.cell, "joint_offset", {{"q6", kOffset_rad}});
  Remeasure(data, {offset}, kSigma_m, 5);
  Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
  REQUIRE(dataset);
  Dataset& rows = dataset.value();
  std::mt19937_64 generator(9);
  std::normal_distribution<double> noise(0, kSigma_rad);
  Eigen::MatrixXd of_pose = Eigen::MatrixXd::Identity(6, 6);
  of_pose.bottomRightCorner<3, 3>() *= std::pow(kSigma_rad / kSigma_m, 2);
  const deflection::LoadedArm arm(data.cell);
  for (const RowIndex row : rows.row_indices()) {
    measure::MeasuredRow& measured = rows.table.rows[row.offset()];
    if (row.value() % 3 == 1) {
      effects::Influence<double> influence;
      effects::AddEffects(std::vector{offset}, rows.conditions[row], influence);
      deflection::LoadedStateOf<double> state;
      REQUIRE(arm.AtCommanded(measured.q, rows.payloads[row], &influence, {}, state));
      const Vec3 off(noise(generator), noise(generator), noise(generator));
      measured.orientation_W = Eigen::Quaterniond(RotationFromVector(off) * state.X_WT.R);
      rows.numbers[row] = {6, of_pose};
    } else if (row.value() % 3 == 2) {
      measured.measured_W = Vec3::Ones();  // must be ignored
      rows.numbers[row] = {0, {}};
    }
  }
  FitProblem problem = UnitWeightFit(rows, 1);
  problem.sigma_m = kSigma_m;
  CHECK(problem.layout().total() == 15 * (3 + 6));
  Model start = Model::Declared(rows);
  start.effects = {EffectWith(data.cell, "joint_offset", {{"q6", 1e-6}})};
  const Result<Refit> refit = RefitModel(problem, start, {});
  REQUIRE(refit);
  const double sd = std::sqrt(refit->covariance(0, 0));
  CHECK(std::abs(refit->model.effects[0].values[0] - kOffset_rad) < 4 * sd);
  // The last axis hardly moves the tip; only the 15 measured orientations determine its offset.
  CHECK(sd < 1.1 * kSigma_rad / std::sqrt(15));
  // chi2 with 134 degrees of freedom, within five standard deviations.
  CHECK(refit->chi2 == Approx(134).margin(5 * std::sqrt(2 * 134)));
  const Result<Linearisation> linear = Linearise(rows, refit->model, false, 1);
  REQUIRE(linear);
  CHECK(RobustSigma(rows, ResidualsOf(*linear)) == Approx(kSigma_m).epsilon(0.3));
}

TEST_CASE("a refit to first order finds frames, sizes and cycles of the exact one") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 60 --repeats 0 --seed 3");
  data.cell.measurement.frame_known = false;
  const std::vector<effects::ActiveEffect> hidden = {
      EffectWith(data.cell, "joint_compliance", {{"q2", 2e-6}, {"q3", 3e-6}}),
      EffectWith(data.cell, "gear_periodic",
                 {{"q4_amplitude", 8e-4}, {"q4_cycles", 3.4}, {"q4_phase", 0.7}})};
  Remeasure(data, hidden, 5e-5, 5);
  Result<Dataset> rows = DatasetFrom(data.cell, data.table);
  REQUIRE(rows);
  FitProblem fit = UnitWeightFit(*rows, 1);
  fit.sigma_m = 5e-5;
  const Result<Model> aligned = Align(*rows, Model::Declared(*rows), 1);
  REQUIRE(aligned);
  const auto linear = std::make_shared<Linearisation>(Linearise(*rows, *aligned, true, 1).value());
  const LinearProblem problem(fit, linear, *aligned);
  Model start = *aligned;
  start.effects = hidden;
  for (effects::ActiveEffect& effect : start.effects) {
    for (double& value : effect.values) value *= 0.98;
  }
  RefitOptions to_first_order;
  to_first_order.first_order = &problem;
  const Result<Refit> exact = RefitModel(fit, start, {});
  const Result<Refit> fast = RefitModel(fit, start, to_first_order);
  REQUIRE(exact);
  REQUIRE(fast);
  CHECK(fast->chi2 == Approx(exact->chi2).epsilon(0.02));
  REQUIRE(fast->parameters.size() == 5);  // two compliances, and a line with its cycles
  for (std::size_t j = 0; j < fast->parameters.size(); ++j) {
    const auto [e, k] = fast->parameters[j];
    const auto place = static_cast<Eigen::Index>(j);
    const double found = fast->model.effects[e].values[k], known = hidden[e].values[k];
    CAPTURE(j, found, known);
    CHECK(std::abs(found - known) < 4 * std::sqrt(fast->covariance(place, place)));
    CHECK(found == Approx(exact->model.effects[e].values[k]).epsilon(0.005));
  }
  const Pose& X_fast = fast->model.frames.front().X_WB;
  CHECK((X_fast.p - exact->model.frames.front().X_WB.p).norm() < 2e-5);
}

TEST_CASE("the columns of a pose equal central differences of its residuals") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 6 --repeats 0 --seed 3");
  data.cell.measurement.kind = model::MeasurementKind::kPose;
  Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
  REQUIRE(dataset);
  Dataset& rows = dataset.value();
  rows.numbers.assign(rows.table.rows.size(), {6, Eigen::MatrixXd::Identity(6, 6)});
  const deflection::LoadedArm arm(data.cell);
  for (const RowIndex row : rows.row_indices()) {
    measure::MeasuredRow& measured = rows.table.rows[row.offset()];
    deflection::LoadedStateOf<double> state;
    REQUIRE(arm.AtCommanded(measured.q, rows.payloads[row], nullptr, {}, state));
    measured.orientation_W = Eigen::Quaterniond(state.X_WT.R);
  }
  const Model model = Model::Declared(rows);
  const Result<Linearisation> linear = Linearise(rows, model, true, 1);
  REQUIRE(linear);
  const auto residual_at = [&](const Model& at) {
    const Result<Linearisation> moved = Linearise(rows, at, false, 1);
    REQUIRE(moved);
    return moved->rows.front().residual;
  };
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 9; ++k) {
    CAPTURE(k);
    Model more = model, less = model;
    const auto move = [&](double step, Model::Frames& frames) {
      if (k < 6) MoveBase(frames.X_WB, step * Eigen::Matrix<double, 6, 1>::Unit(k));
      if (k >= 6) frames.X_FT.front().p += step * Vec3::Unit(k - 6);
    };
    move(kStep, more.frames.front());
    move(-kStep, less.frames.front());
    const Eigen::VectorXd slope = (residual_at(less) - residual_at(more)) / (2 * kStep);
    // A rotated base also rotates gravity, which the columns of the frames neglect.
    CHECK((slope - linear->rows.front().frames.col(k)).norm() < 5e-3);
  }
  for (const int joint : {0, 3, 5}) {
    CAPTURE(joint);
    const std::string name = "q" + std::to_string(joint + 1);
    Model more = model, less = model;
    more.effects = {EffectWith(data.cell, "joint_offset", {{name, kStep}})};
    less.effects = {EffectWith(data.cell, "joint_offset", {{name, -kStep}})};
    const Eigen::VectorXd slope = (residual_at(less) - residual_at(more)) / (2 * kStep);
    CHECK((slope - linear->gradients.front().col(joint)).norm() < 1e-5);
  }
}

TEST_CASE("nearly collinear effects are uncertain individually, but not in sum") {
  const MeasuredCell data = Simulated("--family none --robot ur10 --rows 40 --repeats 0 --seed 3");
  const Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
  REQUIRE(dataset);
  const auto share_of = [&](const std::string& other, const std::string& joint, double& rho) {
    FitProblem problem = UnitWeightFit(*dataset, 1);
    problem.sigma_m = 5e-5;
    Model start = Model::Declared(*dataset);
    start.effects = {EffectWith(data.cell, "joint_offset", {{"q2", 1e-7}}),
                     EffectWith(data.cell, other, {{joint, 1e-7}})};
    Identified found(problem);
    found.refit = RefitModel(problem, start, {}).value();
    const Result<Linearisation> linear = Linearise(*dataset, found.refit.model, true, 1);
    REQUIRE(linear);
    found.linear = std::make_shared<const Linearisation>(*linear);
    const Eigen::MatrixXd& covariance = found.refit.covariance;
    rho = covariance(0, 1) / std::sqrt(covariance(0, 0) * covariance(1, 1));
    // The covariances of a discrepancy model are already scaled; it only raises the factor.
    CHECK(CovarianceShare(found, 1e6) == Approx(1).epsilon(1e-4));
    return CovarianceShare(found, 0);
  };
  // The summed variance of the predictions is 2 for two parameters, and 2 / (1 - rho^2) without
  // their correlation.
  double rho = 0;
  const double alike = share_of("gear_ratio", "q2", rho);
  CHECK(std::abs(rho) > 0.7);
  CHECK(alike == Approx(1 - rho * rho).epsilon(1e-3));
  const double unlike = share_of("joint_offset", "q5", rho);
  CHECK(std::abs(rho) < 0.5);
  CHECK(unlike == Approx(1 - rho * rho).epsilon(1e-3));
}

TEST_CASE("the columns of instrument errors of ranges equal central differences") {
  MeasuredCell data = Simulated("--family none --range --robot ur10 --rows 6 --repeats 0 --seed 3");
  Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
  REQUIRE(dataset);
  const Dataset& rows = *dataset;
  const auto with = [&](double scale, double zero_m, double x_m, double turn_rad) {
    Model model = Model::Declared(rows);
    model.effects = {EffectWith(data.cell, "measurement_scale", {{"scale", scale}}),
                     EffectWith(data.cell, "range_zero", {{"zero", zero_m}}),
                     EffectWith(data.cell, "range_anchor", {{"x", x_m}}),
                     EffectWith(data.cell, "joint_offset", {{"q1", turn_rad}})};
    return model;
  };
  constexpr double kScale = 2e-3, kZero_m = 3e-3, kX_m = 0.01, kTurn_rad = 1e-3;
  const Result<Linearisation> linear =
      Linearise(rows, with(kScale, kZero_m, kX_m, kTurn_rad), true, 1);
  const Result<Linearisation> declared = Linearise(rows, with(0, 0, 0, kTurn_rad), false, 1);
  REQUIRE(linear);
  REQUIRE(declared);
  using I = effects::Influence<double>;
  for (const RowIndex row : rows.row_indices()) {
    // Errors of the instrument do not move the tip.
    const Vec3& tip_W = linear->rows[row].p_W;
    CHECK((tip_W - declared->rows[row].p_W).norm() < 1e-12);
    const double length_m = (tip_W - data.cell.measurement.anchor_W - Vec3(kX_m, 0, 0)).norm();
    const double read_m = *rows.measured(row).range_m - linear->rows[row].residual[0];
    CHECK(read_m == Approx((1 + kScale) * length_m + kZero_m).epsilon(1e-12));
  }
  constexpr double kStep = 1e-5;
  const std::array<std::pair<int, Eigen::Vector4d>, 4> entries = {
      {{I::kScale, Eigen::Vector4d::Unit(0)},
       {I::kRangeZero, Eigen::Vector4d::Unit(1)},
       {I::kRangeAnchor, Eigen::Vector4d::Unit(2)},
       {I::kTurn * model::kMaxJoints, Eigen::Vector4d::Unit(3)}}};
  for (const auto& pair : entries) {
    const int entry = pair.first;
    const Eigen::Vector4d& step = pair.second;
    const auto residual = [&](double sign) {
      const Eigen::Vector4d at =
          Eigen::Vector4d(kScale, kZero_m, kX_m, kTurn_rad) + sign * kStep * step;
      const Result<Linearisation> moved =
          Linearise(rows, with(at[0], at[1], at[2], at[3]), false, 1);
      REQUIRE(moved);
      return moved->rows.front().residual[0];
    };
    CAPTURE(entry);
    const double slope = (residual(-1) - residual(1)) / (2 * kStep);
    CHECK(linear->gradients.front()(0, entry) == Approx(slope).epsilon(1e-6));
  }
}

TEST_CASE("a time constant remains within its range") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 60 --seed 3");
  const auto drift = [&](double time_constant_s) {
    return EffectWith(data.cell, "thermal_drift",
                      {{"x", 1e-3}, {"y", 0}, {"z", 0}, {"time_constant", time_constant_s}});
  };
  constexpr double kSigma_m = 5e-5, kLeast_s = 10;  // kLeast_s: lower end of the range
  Remeasure(data, {drift(600)}, kSigma_m, 5);
  const Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
  REQUIRE(dataset);
  FitProblem problem = UnitWeightFit(*dataset, 1);
  problem.sigma_m = kSigma_m;
  const auto refitted = [&](double start_s) {
    Model start = Model::Declared(*dataset);
    start.effects = {drift(start_s)};
    const Result<Refit> refit = RefitModel(problem, start, {50});
    REQUIRE(refit);
    return *refit;
  };
  const Refit near = refitted(500), outside = refitted(kLeast_s / 10);
  CHECK(near.model.effects[0].values[3] == Approx(600).epsilon(0.2));
  CHECK(outside.model.effects[0].values[3] >= kLeast_s);
  CHECK(outside.chi2 == Approx(near.chi2).epsilon(0.01));
}

TEST_CASE(
    "detection limits of poses are lengths, independent of the weight of their orientations") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 30 --repeats 0 --seed 3");
  Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
  REQUIRE(dataset);
  Dataset& rows = dataset.value();
  const deflection::LoadedArm arm(data.cell);
  const auto detectable_m = [&](double rad_per_m) {
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(6, 6);
    covariance.bottomRightCorner<3, 3>() *= rad_per_m * rad_per_m;
    for (const RowIndex row : rows.row_indices()) {
      measure::MeasuredRow& measured = rows.table.rows[row.offset()];
      deflection::LoadedStateOf<double> state;
      REQUIRE(arm.AtCommanded(measured.q, rows.payloads[row], nullptr, {}, state));
      measured.orientation_W = Eigen::Quaterniond(state.X_WT.R);
      rows.numbers[row] = {6, covariance};
    }
    FitProblem fit = UnitWeightFit(rows, 1);
    fit.sigma_m = 5e-5;
    const Model model = Model::Declared(rows);
    const Result<Linearisation> linear = Linearise(rows, model, true, 1);
    REQUIRE(linear);
    const LinearProblem problem(fit, std::make_shared<const Linearisation>(*linear), model);
    CandidateSet candidate_set(problem);
    const BlockIndex block =
        candidate_set.Add(WholeBlock(rows, *effects::FindEffect("joint_offset"), ""));
    return candidate_set.MinimumDetectable(block, 0)[BlockColumnIndex(1)];
  };
  // With orientations ten times as certain, a tenth of the size, and of the displacement, is
  // detectable.
  CHECK(detectable_m(0.01) == Approx(detectable_m(0.1) / 10).epsilon(0.1));
}

TEST_CASE("a unit that explains noise is dropped, unless the others then need an impossible size") {
  constexpr double kSigma_m = 5e-5;
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 60 --repeats 0 --seed 3");
  Remeasure(data, {EffectWith(data.cell, "joint_offset", {{"q3", 1e-3}})}, kSigma_m, 5);
  const Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
  REQUIRE(dataset);
  FitProblem fit = UnitWeightFit(*dataset, 1);
  fit.sigma_m = kSigma_m;
  const Model model = Model::Declared(*dataset);
  const Result<Linearisation> linear = Linearise(*dataset, model, true, 1);
  REQUIRE(linear);
  const LinearProblem problem(fit, std::make_shared<const Linearisation>(*linear), model);
  CandidateSet candidate_set(problem);
  const BlockIndex block =
      candidate_set.Add(WholeBlock(*dataset, *effects::FindEffect("joint_offset"), ""));
  std::vector<ColumnIndex> q3_and_q5;
  for (const ColumnIndex column : candidate_set.ColumnsOf({block})) {
    const int joint = candidate_set.JointOfColumn(column);
    if (joint == 2 || joint == 4) q3_and_q5.push_back(column);
  }
  REQUIRE(q3_and_q5.size() == 2);
  const auto honest = [&](const Explanation& explanation) {
    Model start = model;
    start.effects =
        EffectsFrom(*dataset, candidate_set.blocks(), candidate_set.CoefficientsOf(explanation));
    return RefitModel(fit, start, {});
  };
  const auto left_by = [&](const RefitExplanation& refit) {
    const Explanation both = candidate_set.FitColumns(q3_and_q5);
    Result<Refit> start = honest(both);
    REQUIRE(start);
    return EliminateUnsupportedUnits(candidate_set, {both, std::move(start).value()}, refit)
        .explanation.columns;
  };
  CHECK(left_by(honest) == std::vector<ColumnIndex>{q3_and_q5.front()});
  // As good a fit whose remaining offset is three radians.
  CHECK(left_by([&](const Explanation& explanation) {
          Refit refit = honest(explanation).value();
          refit.model.effects.front().values.front() = 3;
          return Result<Refit>(std::move(refit));
        }) == q3_and_q5);
}

}  // namespace plumbline::refit_test
