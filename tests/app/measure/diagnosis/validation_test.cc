// Held-out rows: fold plans, acceptance of model parts, and the checks of an explanation.
#include <catch2/catch.hpp>
#include <map>
#include <random>
#include <set>
#include <stdexcept>

#include "app/measure/diagnosis/critics/explanation_checks.h"
#include "app/measure/diagnosis/critics/lack_of_fit.h"
#include "app/measure/diagnosis/linear/shape_search.h"
#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "app/measure/diagnosis/search/findings.h"
#include "app/measure/diagnosis/validation/farthest_poses.h"
#include "app/measure/diagnosis/validation/held_out.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/effects/empirical.h"
#include "tests/app/measure/diagnosis/simulated.h"

namespace plumbline::validation_test {

using namespace plumbline::measure;

namespace {

Dataset DatasetOf(const std::string& options) {
  const MeasuredCell data = Simulated(options);
  const Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
  REQUIRE(dataset);
  return *dataset;
}

/// Held-out residuals of one size [m] along x in every row.
HeldOut HeldOutOf(const Dataset& data, double size_m) {
  HeldOut held_out;
  const auto rows = static_cast<std::size_t>(data.rows());
  held_out.by = "blocks of time";
  held_out.predicted.assign(rows, true);
  held_out.before.assign(rows, Vec3(1e-3, 0, 0));
  held_out.after = held_out.after_named = PerRow<Vec3>(rows, Vec3(size_m, 0, 0));
  return held_out;
}

Diagnosis Explained(const std::string& id) {
  Diagnosis diagnosis;
  diagnosis.verdict = Verdict::kExplained;
  Finding& finding = diagnosis.findings.emplace_back();
  finding.effect.term.effect = effects::FindEffect(id);
  finding.p_value = 1e-9;
  finding.covariance = Eigen::MatrixXd::Identity(1, 1);
  return diagnosis;
}

const ExplanationCheck& CheckNamed(const Diagnosis& diagnosis, const std::string& name) {
  for (const ExplanationCheck& check : diagnosis.checks) {
    if (check.name == name) return check;
  }
  throw std::runtime_error("no check " + name);
}

}  // namespace

TEST_CASE("of a correction, the share is applied that predicts held-out rows best") {
  const Dataset data = DatasetOf("--family none --robot ur10 --rows 40 --seed 3");
  const PerRow<double> weights(static_cast<std::size_t>(data.rows()), 1.0);
  CHECK(BestShare(HeldOutOf(data, 0), weights) == Approx(1));        // removes all of the error
  CHECK(BestShare(HeldOutOf(data, -1e-3), weights) == Approx(0.5));  // overshoots by as much again
  CHECK(BestShare(HeldOutOf(data, 5e-4), weights) == 1);             // twice as much would be best
  CHECK(BestShare(HeldOutOf(data, 2e-3), weights) == 0);             // the wrong way
  CHECK(BestShare(HeldOutOf(data, 1e-3), weights) == 1);             // moves nothing
  HeldOut across = HeldOutOf(data, 0);
  for (Vec3& after : across.after) after = Vec3(0, 2e-3, 0);
  CHECK(BestShare(across, weights) == Approx(1.0 / 5));  // b = (1, 0), b - a = (1, -2)
}

TEST_CASE("replicates share a region, and sessions are held out one by one") {
  const Dataset data = DatasetOf("--family none --seed 3 --unaligned --sessions 2");
  const FoldPlan regions = RegionsOfJointSpace(data);
  REQUIRE(regions.fold_of.size() == data.table.rows.size());
  CHECK(std::set<int>(regions.fold_of.begin(), regions.fold_of.end()).size() == 5);
  std::map<ClusterIndex, int> of_cluster;
  for (const RowIndex row : data.row_indices()) {
    const auto [known, fresh] = of_cluster.emplace(data.cluster_of[row], regions.fold_of[row]);
    CHECK(known->second == regions.fold_of[row]);
  }
  const FoldPlan sessions = Sessions(data);
  CHECK(sessions.folds == 2);
  for (const RowIndex row : data.row_indices()) {
    CHECK(sessions.fold_of[row] == data.session_of[row].value());
  }
  CHECK(sessions.aligned);
  CHECK(Sessions(DatasetOf("--family none --seed 3")).folds == 0);
}

TEST_CASE(
    "rows between the last training row before a step and the first one after it are not "
    "predicted") {
  const MeasuredCell cell = Simulated("--family none --seed 3 --rows 40 --repeats 0");
  const Result<Dataset> read = DatasetFrom(cell.cell, cell.table);
  REQUIRE(read);
  const Dataset& data = *read;
  const Model model = Model::Declared(data);
  const Result<Linearisation> linear = Linearise(data, model, true, 1);
  REQUIRE(linear);
  constexpr RowIndex kFirstHeldOut(18), kLastHeldOut(23), kBeforeStep(20), kAfterStep(21);
  FitRows training;
  for (const RowIndex row : data.row_indices()) {
    if (row < kFirstHeldOut || row > kLastHeldOut) training.push_back(row);
  }
  const LinearProblem problem(UnitWeightFit(data, 1).WithRows(training),
                              std::make_shared<const Linearisation>(*linear), model);
  const double time_s = (*data.conditions[kBeforeStep].t_s + *data.conditions[kAfterStep].t_s) / 2;
  const effects::ActiveEffect step = EffectWith(
      cell.cell, "step_event", {{"time", time_s}, {"x", 1e-3}, {"y", 0}, {"z", 0}}, "base");
  const ShapeSearch& search = *ShapeSearchOf(*step.term.effect);
  const Block block = search.Refitted(data, step).front();
  for (const RowIndex row : data.row_indices()) {
    CAPTURE(row.value());
    CHECK(search.LeavesUndetermined(problem, block, row) ==
          (row >= kFirstHeldOut && row <= kLastHeldOut));
  }
}

TEST_CASE("an explanation that few folds select, or that chance may produce, is in doubt") {
  const Dataset data = DatasetOf("--family none --seed 3");
  const FitProblem problem = UnitWeightFit(data, 1);
  const double sigma_m = problem.sigma_m;
  HeldOut held_out = HeldOutOf(data, std::sqrt(3) * sigma_m);
  const ExplanationEvidence evidence{problem, held_out, 2, 0};
  const std::vector<SelectedEffect> taken = {{{"gear_ratio", ""}, {}}}, nothing;

  held_out.selected = {taken, taken, taken, taken, nothing};
  Diagnosis diagnosis = Explained("gear_ratio");
  CheckExplanation(evidence, diagnosis);
  CHECK(diagnosis.verdict == Verdict::kExplained);
  CHECK(diagnosis.doubts.empty());
  CHECK(CheckNamed(diagnosis, "selection_frequency").figure == Approx(0.8));

  held_out.selected = {taken, taken, taken, nothing, nothing};
  diagnosis = Explained("gear_ratio");
  CheckExplanation(evidence, diagnosis);
  CHECK(diagnosis.verdict == Verdict::kAmbiguous);
  REQUIRE(diagnosis.doubts.size() == 1);
  CHECK(diagnosis.doubts[0].id == "gear_ratio");
  CHECK(diagnosis.doubts[0].reason.find("3 of 5") != std::string::npos);

  held_out.selected.assign(5, taken);
  diagnosis = Explained("gear_ratio");
  diagnosis.findings[0].p_value = 1;
  CheckExplanation(evidence, diagnosis);
  CHECK(diagnosis.verdict == Verdict::kAmbiguous);
  CHECK_FALSE(CheckNamed(diagnosis, "p_value").passed);

  diagnosis = Explained("gear_ratio");
  diagnosis.findings[0].covariance.resize(0, 0);
  CheckExplanation(evidence, diagnosis);
  CHECK(diagnosis.verdict == Verdict::kAmbiguous);
  CHECK_FALSE(CheckNamed(diagnosis, "determined").passed);

  diagnosis = Explained("gear_ratio");
  diagnosis.findings[0].implausible = "beyond what a healthy machine shows";
  diagnosis.findings[0].implausible_times = 3;  // a worn machine
  CheckExplanation(evidence, diagnosis);
  CHECK(diagnosis.verdict == Verdict::kExplained);
  CHECK(diagnosis.doubts.empty());
  diagnosis = Explained("gear_ratio");
  diagnosis.findings[0].implausible = "beyond what any machine shows";
  diagnosis.findings[0].implausible_times = 5;
  CheckExplanation(evidence, diagnosis);
  CHECK(diagnosis.verdict == Verdict::kAmbiguous);
  CHECK(diagnosis.doubts.size() == 1);
}

TEST_CASE(
    "held-out errors beyond the noise, or a large discrepancy model, make the verdict unknown") {
  const Dataset data = DatasetOf("--family none --seed 3");
  const FitProblem problem = UnitWeightFit(data, 1);
  const double sigma_m = problem.sigma_m;
  HeldOut held_out = HeldOutOf(data, 2 * std::sqrt(3) * sigma_m);
  held_out.selected.assign(5, {{{"gear_ratio", ""}, {}}});
  Diagnosis diagnosis = Explained("gear_ratio");
  CheckExplanation({problem, held_out, 2, 0}, diagnosis);
  CHECK(diagnosis.verdict == Verdict::kUnknown);
  CHECK(CheckNamed(diagnosis, "held_out_error").figure >
        CheckNamed(diagnosis, "held_out_error").limit);

  held_out = HeldOutOf(data, sigma_m);
  diagnosis = Explained("gear_ratio");
  CheckExplanation({problem, held_out, 2, 3 * sigma_m}, diagnosis);
  CHECK(diagnosis.verdict == Verdict::kUnknown);
  CHECK_FALSE(CheckNamed(diagnosis, "discrepancy_model").passed);
}

TEST_CASE("values smaller than their standard deviations are not determined") {
  const Dataset data = DatasetOf("--family none --seed 3");
  const FitProblem problem = UnitWeightFit(data, 1);
  const HeldOut held_out = HeldOutOf(data, problem.sigma_m);
  const auto check_of = [&](const std::vector<double>& values, const Eigen::Vector4d& deviations) {
    Diagnosis diagnosis = Explained("thermal_drift");
    effects::ActiveEffect& effect = diagnosis.findings[0].effect;
    effect = EffectWith(
        data.cell, "thermal_drift",
        {{"x", values[0]}, {"y", values[1]}, {"z", values[2]}, {"time_constant", values[3]}});
    diagnosis.findings[0].covariance = deviations.cwiseAbs2().asDiagonal();
    CheckExplanation({problem, held_out, 2, 0}, diagnosis);
    return CheckNamed(diagnosis, "determined");
  };
  const ExplanationCheck linear =
      check_of({3.6e-3, -1.8e-3, 6e-5, 17575}, {7.1e-3, 3.5e-3, 1.5e-4, 36685});
  CHECK_FALSE(linear.passed);
  CHECK_THAT(linear.sentence, Catch::Contains("x, y, z and time_constant separately"));
  // A small component of a displacement that the rows determine.
  CHECK(check_of({3.6e-3, -1.8e-3, 6e-5, 900}, {1e-4, 1e-4, 1.5e-4, 60}).passed);
  const ExplanationCheck one = check_of({3.6e-3, -1.8e-3, 2e-4, 900}, {1e-4, 1e-4, 1e-4, 1000});
  CHECK_THAT(one.sentence, Catch::Contains("do not determine time_constant: its standard"));
}

TEST_CASE("effects that do not improve held-out points are in doubt") {
  const Dataset data = DatasetOf("--family none --seed 3");
  const FitProblem problem = UnitWeightFit(data, 1);
  for (const bool better : {true, false}) {
    CAPTURE(better);
    Diagnosis diagnosis = Explained("gear_ratio");
    diagnosis.held_out_by = "blocks of time";
    diagnosis.held_out.before_m = 1e-4;
    diagnosis.held_out.after_m = better ? 0.9e-4 : 1e-4;
    CheckExplanation({problem, HeldOutOf(data, problem.sigma_m), 2, 0, data.sigma_m}, diagnosis);
    CHECK(CheckNamed(diagnosis, "held_out_gain").passed == better);
    CHECK(diagnosis.verdict == (better ? Verdict::kExplained : Verdict::kAmbiguous));
  }
}

TEST_CASE("a residual beyond the declared noise is in doubt, and far beyond it not explained") {
  const Dataset data = DatasetOf("--family none --seed 3");
  const FitProblem problem = UnitWeightFit(data, 1);
  for (const auto& [times, verdict] :
       {std::pair(1.1, Verdict::kExplained), std::pair(1.8, Verdict::kAmbiguous),
        std::pair(2.2, Verdict::kUnknown)}) {
    CAPTURE(times);
    Diagnosis diagnosis = Explained("gear_ratio");
    CheckExplanation({problem, HeldOutOf(data, problem.sigma_m), 2, 0, times * data.sigma_m},
                     diagnosis);
    CHECK(CheckNamed(diagnosis, "residual_noise").passed == (verdict == Verdict::kExplained));
    CHECK(diagnosis.verdict == verdict);
  }
}

TEST_CASE("a fold that selected other effects is not used for the held-out error") {
  const Dataset data = DatasetOf("--family none --seed 3");
  const FitProblem problem = UnitWeightFit(data, 1);
  HeldOut held_out = HeldOutOf(data, data.sigma_m);
  const FoldPlan plan = BlocksOfTime(data);
  held_out.fold_of = plan.fold_of;
  held_out.selected.assign(5, {{{"gear_ratio", ""}, {}}});
  held_out.selected[2] = {{{"joint_offset", ""}, {}}};
  for (const RowIndex row : data.row_indices()) {
    if (plan.fold_of[row] == 2) held_out.after[row] *= 30;
  }
  Diagnosis diagnosis = Explained("gear_ratio");
  CheckExplanation({problem, held_out, 2, 0}, diagnosis);
  CHECK(CheckNamed(diagnosis, "held_out_error").passed);
  CHECK(diagnosis.verdict == Verdict::kExplained);  // four of five folds
  held_out.selected[2] = {{{"gear_ratio", ""}, {}}};
  diagnosis = Explained("gear_ratio");
  CheckExplanation({problem, held_out, 2, 0}, diagnosis);
  CHECK_FALSE(CheckNamed(diagnosis, "held_out_error").passed);
}

TEST_CASE("a fold that selected other joints of the effect is not used for the held-out error") {
  const Dataset data = DatasetOf("--family none --seed 3");
  const FitProblem problem = UnitWeightFit(data, 1);
  HeldOut held_out = HeldOutOf(data, data.sigma_m);
  const FoldPlan plan = BlocksOfTime(data);
  held_out.fold_of = plan.fold_of;
  held_out.selected.assign(5, {{{"gear_ratio", ""}, {1, 2}}});
  for (const RowIndex row : data.row_indices()) {
    if (plan.fold_of[row] == 2) held_out.after[row] *= 30;
  }
  for (const bool agrees : {true, false}) {
    if (!agrees) held_out.selected[2] = {{{"gear_ratio", ""}, {1}}, {{"joint_offset", ""}, {2}}};
    Diagnosis diagnosis = Explained("gear_ratio");
    diagnosis.findings.front().effect.term.parameters = {{0, 1}, {0, 2}};
    CheckExplanation({problem, held_out, 2, 0}, diagnosis);
    CHECK(CheckNamed(diagnosis, "held_out_error").passed == !agrees);
    CHECK(CheckNamed(diagnosis, "selection_frequency").figure == Approx(agrees ? 1 : 0.8));
  }
}

TEST_CASE("few distinct poses are one region each, regardless of payload") {
  Dataset data = DatasetOf("--family none --seed 3");
  const int joints = data.cell.robot.size();
  for (const RowIndex row : data.row_indices()) {
    data.table.rows[row.offset()].q.head(joints) = data.table.rows[row.offset() % 3].q.head(joints);
    data.cluster_of[row] = ClusterIndex(row.value() % 6);
  }
  data.clusters = 6;
  const FoldPlan plan = RegionsOfJointSpace(data);
  CHECK(plan.folds == 3);
  for (const RowIndex row : data.row_indices()) {
    CHECK(plan.fold_of[row] == plan.fold_of[RowIndex(row.value() % 3)]);
  }
}

TEST_CASE("the halves of the joint space have equal sizes, and replicates share one") {
  const Dataset data = DatasetOf("--family none --seed 3");
  const FoldPlan plan = OppositeHalves(data);
  REQUIRE(plan.folds == 2);
  std::map<ClusterIndex, int> half_of;
  int in_first = 0;
  for (const RowIndex row : data.row_indices()) {
    const auto [known, fresh] = half_of.emplace(data.cluster_of[row], plan.fold_of[row]);
    CHECK(known->second == plan.fold_of[row]);
    in_first += fresh && plan.fold_of[row] == 0 ? 1 : 0;
  }
  CHECK(in_first == data.clusters / 2);
  // The halves are farther from each other than a region is from the rest.
  const auto mean_distance = [&](const FoldPlan& folds, int fold) {
    std::vector<model::JointVector> others;
    for (const RowIndex row : data.row_indices()) {
      if (folds.fold_of[row] != fold) others.push_back(data.measured(row).q);
    }
    const kinematics::PoseDistance distance = DistanceFrom(data.cell, others);
    double sum = 0, count = 0;
    for (const RowIndex row : data.row_indices()) {
      if (folds.fold_of[row] != fold) continue;
      sum += distance.Of(data.measured(row).q);
      count += 1;
    }
    return sum / count;
  };
  const FoldPlan regions = RegionsOfJointSpace(data);
  double of_regions = 0;
  for (int fold = 0; fold < regions.folds; ++fold) of_regions += mean_distance(regions, fold);
  CHECK(0.5 * (mean_distance(plan, 0) + mean_distance(plan, 1)) > of_regions / regions.folds);
}

TEST_CASE("held-out regions decide on a discrepancy model, not the rows between") {
  const Dataset data = DatasetOf("--family none --seed 3");
  const PerRow<double> weights(data.table.rows.size(), 1.0);
  HeldOut by_time = HeldOutOf(data, 1e-4), by_region = by_time;
  by_time.after_named.assign(weights.size(), Vec3(2e-4, 0, 0));
  by_region.after_named.assign(weights.size(), Vec3(0.5e-4, 0, 0));
  CHECK(AdmitsDiscrepancy({{by_time}, {}}, weights));
  CHECK_FALSE(AdmitsDiscrepancy({{by_time, by_region}, {}}, weights));
  // Schemes without predicted rows do not count.
  by_region.predicted.assign(weights.size(), false);
  CHECK(AdmitsDiscrepancy({{by_time, by_region}, {}}, weights));
  by_time.predicted.assign(weights.size(), false);
  CHECK_FALSE(AdmitsDiscrepancy({{by_time, by_region}, {}}, weights));
}

TEST_CASE("a correction that increases the held-out error is withheld") {
  HeldOut by_time;
  by_time.by = "blocks of time";
  const HeldOutError better{"blocks of time", 1e-3, 1e-4, 0, 0};
  const HeldOutError worse{"regions of the joint space", 1e-3, 2e-3, 0, 0};
  CHECK(ReasonToWithhold({{by_time}, {better, worse}}, false).empty());
  CHECK(ReasonToWithhold({{by_time}, {better}}, true).empty());
  CHECK(ReasonToWithhold({{by_time}, {}}, false).find("too few rows") == 0);
  CHECK(ReasonToWithhold({{by_time}, {better, worse}}, true).find("regions") != std::string::npos);
}

TEST_CASE("an empirical curve remains within its values at the rows") {
  const Dataset data = DatasetOf("--family thermal_growth --seed 3");
  const Result<Linearisation> linear = Linearise(data, Model::Declared(data), true, 1);
  REQUIRE(linear);
  double low = 1e9, high = -1e9;
  for (const measure::MeasuredRow& row : data.table.rows) {
    low = std::min(low, *row.temp_C);
    high = std::max(high, *row.temp_C);
  }
  effects::ActiveEffect effect;
  effect.term.effect = &effects::Empirical();
  effect.term.drivers = {"temp_C"};
  effect.term.parameters = {{0, -1, 1}};  // base_x
  effect.values = {1};
  effect.term.nodes.resize(4, 2);
  // 0.1 mm between the rows; 50 mm at an edge beyond them.
  effect.term.nodes << low - 1, 0.1, low, 0.1, high, 0.1, high + 1, 50;
  BoundToRows(UnitWeightFit(data, 1), *linear, effect);
  CHECK(effect.term.nodes.col(1).maxCoeff() == Approx(0.1));
  CHECK(effect.term.nodes.col(1).minCoeff() == Approx(0.1));
}

/// Residuals with noise of each row and one deviation [m] of each pose.
/// @param tail  degrees of freedom of Student's t, scaled to sigma_m; 0: normal
PerRow<RowResidual> ResidualsWith(const Dataset& data, double sigma_m, double of_pose_m, int tail,
                                  std::mt19937_64& random) {
  std::normal_distribution<double> normal(0, 1);
  std::student_t_distribution<double> student(tail > 0 ? tail : 1);
  const double scale = tail > 0 ? std::sqrt((tail - 2.0) / tail) : 1;
  const auto draw = [&] { return tail > 0 ? scale * student(random) : normal(random); };
  Indexed<ClusterIndex, Vec3> of_pose(static_cast<std::size_t>(data.clusters), Vec3::Zero());
  for (Vec3& one : of_pose) {
    for (double& x : one) x = of_pose_m * normal(random);
  }
  PerRow<RowResidual> residuals;
  for (const RowIndex row : data.row_indices()) {
    RowResidual residual = of_pose[data.cluster_of[row]];
    for (double& x : residual) x += sigma_m * draw();
    residuals.push_back(residual);
  }
  return residuals;
}

/// Share of data sets whose lack of fit is significant.
double SignificantShare(const Dataset& data, double of_pose_m, int tail) {
  constexpr int kSets = 2000;
  std::mt19937_64 random(11);
  const PerRow<double> weights(static_cast<std::size_t>(data.rows()), 1.0);
  int significant = 0;
  for (int k = 0; k < kSets; ++k) {
    const auto residuals = ResidualsWith(data, 5e-5, of_pose_m, tail, random);
    const auto found = LackOfFitOf(data, residuals, weights, 0, 0);
    REQUIRE(found);
    significant += found->significant() ? 1 : 0;
  }
  return static_cast<double>(significant) / kSets;
}

TEST_CASE("a lack of fit is significant once in a thousand sets without one, and seen with one") {
  Dataset data = DatasetOf("--family none --robot ur10 --rows 40 --repeats 20 --seed 6");
  data.sigma_m = 0;
  CHECK(SignificantShare(data, 0, 0) <= 0.003);
  CHECK(SignificantShare(data, 0, 5) <= 0.003);  // heavy tails
  CHECK(SignificantShare(data, 7e-5, 0) >= 0.9);
  // What the owner states as noise is not a lack of fit, and less than half the noise is not
  // notable.
  data.sigma_m = 1e-4;
  CHECK(SignificantShare(data, 7e-5, 0) <= 0.003);
}

TEST_CASE("without replicates no lack of fit is stated") {
  const Dataset data = DatasetOf("--family none --robot ur10 --rows 40 --repeats 0 --seed 6");
  std::mt19937_64 random(1);
  const PerRow<double> weights(static_cast<std::size_t>(data.rows()), 1.0);
  CHECK_FALSE(LackOfFitOf(data, ResidualsWith(data, 5e-5, 0, 0, random), weights, 0, 0));
}

}  // namespace plumbline::validation_test
