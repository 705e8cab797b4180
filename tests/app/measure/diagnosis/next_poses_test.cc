// Proposal of poses: design space, discrimination criterion, sequential design; and the Hampel
// loss.
#include <catch2/catch.hpp>
#include <set>

#include "app/measure/diagnosis/design/discrimination.h"
#include "app/measure/diagnosis/design/pose_design.h"
#include "app/measure/diagnosis/linear/alignment.h"
#include "app/measure/diagnosis/linear/robust.h"
#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "app/measure/diagnosis/search/identify.h"
#include "firmware-like/effects/catalogue.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::next_poses_test {

using namespace plumbline::measure;
using plumbline::test::HeavyArm;

namespace {

constexpr double kSigma_m = 5e-5;
constexpr double kStep_s = 60;

measure::MeasuredTable Table(const model::CellModel& cell, const std::vector<double>& payloads_kg) {
  measure::MeasuredTable table;
  table.file = "rows";
  table.recorded.position = table.recorded.payload = table.recorded.time = true;
  Random random(7);
  for (int k = 0; k < 40; ++k) {
    measure::MeasuredRow row;
    row.line = 2 * k + 3;
    row.t_s = kStep_s * k;
    row.measured_W = Vec3::Zero();
    row.q.setZero(cell.robot.size());
    for (Eigen::Index i = 0; i < row.q.size(); ++i) row.q[i] = 1.8 * (random.Uniform() - 0.5);
    row.payload_kg = payloads_kg[static_cast<std::size_t>(k) % payloads_kg.size()];
    table.rows.push_back(row);
  }
  return table;
}

model::CellModel Cell() {
  model::CellModel cell = HeavyArm();
  cell.measurement.sigma_m = kSigma_m;
  cell.robot.joints[0].min = -1.0;
  cell.robot.joints[0].max = 1.0;
  return cell;
}

/// Poses of the heavy arm with the tips predicted by the declared model.
Dataset Rows(measure::MeasuredTable table) {
  const model::CellModel cell = Cell();
  Result<Dataset> data = DatasetFrom(cell, table);
  REQUIRE(data);
  const Result<Linearisation> tips = Linearise(*data, Model::Declared(*data), false, 1);
  REQUIRE(tips);
  for (std::size_t k = 0; k < table.rows.size(); ++k)
    table.rows[k].measured_W = tips->rows[RowIndex(k)].p_W;
  data = DatasetFrom(cell, table);
  REQUIRE(data);
  return *data;
}

Dataset Rows(const std::vector<double>& payloads_kg) {
  return Rows(Table(Cell(), payloads_kg));
}

/// Rows that were all approached with increasing joint angles, from a via pose each.
Dataset RowsFromOneSide() {
  measure::MeasuredTable table = Table(Cell(), {20});
  for (measure::MeasuredRow via : table.rows) {
    via.line -= 1;
    via.q.array() -= 0.1;
    table.unmeasured.push_back(via);
  }
  return Rows(std::move(table));
}

Block BlockOf(const Dataset& data, std::string_view id, std::string_view word = "") {
  const effects::Effect* effect = effects::FindEffect(id);
  REQUIRE(effect != nullptr);
  return WholeBlock(data, *effect, word);
}

/// Block of three base translations with these other parameters.
Block ShiftBlock(std::string_view id, std::string_view word,
                 const std::vector<effects::TermParameter>& parameters, std::size_t first,
                 const std::vector<double>& values) {
  Block block;
  block.term.effect = effects::FindEffect(id);
  block.id = id;
  block.term.word = word;
  block.term.parameters = parameters;
  for (std::size_t k = 0; k < 3; ++k) {
    BlockColumn& column = block.columns.emplace_back();
    column.parameter = static_cast<int>(first + k);
    column.values = values;
    column.plausible = {-5e-3, 5e-3};
  }
  return block;
}

/// Two explanations of one block each with equal scores, and the input for their design.
struct TwoExplanations {
  TwoExplanations(const Dataset& rows, const Block& a, const Eigen::VectorXd& of_a, const Block& b,
                  const Eigen::VectorXd& of_b)
      : data(rows), model(Model::Declared(data)) {
    const Result<Linearisation> linear = LineariseApart(data, model, 1);
    REQUIRE(linear);
    FitProblem fit = UnitWeightFit(data, 1);
    fit.sigma_m = kSigma_m;
    problem = std::make_unique<LinearProblem>(
        std::move(fit), std::make_shared<const Linearisation>(*linear), model);
    candidate_set = std::make_unique<CandidateSet>(*problem);
    std::vector<Explanation> pair;
    ColumnIndex next;
    for (const auto& [block, values] : {std::pair(&a, &of_a), std::pair(&b, &of_b)}) {
      Explanation explanation;
      explanation.blocks = {candidate_set->Add(*block)};
      for (std::size_t k = 0; k < block->columns.size(); ++k, ++next) {
        explanation.columns.push_back(next);
      }
      explanation.values = *values;
      pair.push_back(explanation);
    }
    task = std::make_unique<DesignTask>(DesignTask{*candidate_set, model, data, pair});
    space =
        DesignSpaceOf(data, {&candidate_set->blocks().front(), &candidate_set->blocks().back()});
  }

  PoseDesign Design() const { return SequentialDesign(*task, space).Run(); }

  Dataset data;
  Model model;
  std::unique_ptr<LinearProblem> problem;
  std::unique_ptr<CandidateSet> candidate_set;
  std::unique_ptr<DesignTask> task;
  DesignSpace space;
};

/// A value at one joint (0-based), zero at the others.
Eigen::VectorXd AtJoint(const Dataset& data, int joint, double value) {
  Eigen::VectorXd values = Eigen::VectorXd::Zero(data.cell.robot.size());
  values[joint] = value;
  return values;
}

TwoExplanations PlayOrOffset() {
  const Dataset data = RowsFromOneSide();
  return {data, BlockOf(data, "joint_offset"), AtJoint(data, 1, 3e-4),
          BlockOf(data, "backlash", "move"), AtJoint(data, 1, 3e-4)};
}

}  // namespace

TEST_CASE("candidates are within the measured range, the joint limits and the given payloads") {
  const Dataset data = Rows({20, 20, 60});
  DesignSpace space = DesignSpaceOf(data, {});
  CHECK(space.payloads_kg == std::vector<double>{20, 60});
  CHECK(space.approached.empty());
  CHECK(space.waits_s == std::vector<double>{0});
  CHECK(space.motions.empty());
  space.payloads_kg = {0, 60};
  const std::vector<DesignPoint> points = RandomPoints(space);
  REQUIRE(points.size() >= 400);
  const Dataset candidates = CandidateRows(data, space, points, data.conditions.back());
  std::set<double> payloads;
  for (std::size_t k = 0; k < candidates.table.rows.size(); ++k) {
    const measure::MeasuredRow& row = candidates.table.rows[k];
    payloads.insert(*row.payload_kg);
    CHECK(points[k].Extras() == 0);
    CHECK(candidates.payloads[RowIndex(k)].mass_kg == row.payload_kg);
    CHECK(candidates.conditions[RowIndex(k)].payload_kg == row.payload_kg);
    CHECK(candidates.conditions[RowIndex(k)].q == row.q);
    CHECK(candidates.conditions[RowIndex(k)].t_s == data.conditions.back().t_s);
    CHECK(std::abs(row.q[0]) <= 1.0);
    for (Eigen::Index i = 1; i < row.q.size(); ++i) CHECK(std::abs(row.q[i]) <= 0.9 * 1.5);
  }
  CHECK(payloads == std::set<double>{0, 60});
}

TEST_CASE("a candidate is reached from the previous pose; an unmoved joint keeps its side") {
  const Dataset data = Rows({20});
  const DesignSpace space = DesignSpaceOf(data, {});
  const std::vector<DesignPoint> points = RandomPoints(space);
  Dataset candidates = CandidateRows(data, space, points, data.conditions.back());
  effects::Conditions previous = data.conditions.back();
  previous.approach = model::JointVector::Constant(previous.q.size(), -1.0);
  previous.q[2] = candidates.conditions.front().q[2];
  previous.q[3] = candidates.conditions.front().q[3] - 0.1;
  previous.q[4] = candidates.conditions.front().q[4] + 0.1;
  SetApproach(previous, space, points, candidates);
  CHECK(candidates.conditions.front().approach[2] == -1.0);
  CHECK(candidates.conditions.front().approach[3] == 1.0);
  CHECK(candidates.conditions.front().approach[4] == -1.0);
  CHECK(candidates.conditions.front().last_move[3] == Approx(0.1));
}

TEST_CASE("side, wait and motion change the conditions of a candidate, within the limits") {
  const Dataset data = Rows({20});
  DesignSpace space = DesignSpaceOf(data, {});
  const Eigen::Index n = space.low.size();
  space.approached = {1, 2};
  space.waits_s = {0, 600};
  space.motions = {{model::JointVector::Zero(n), {}}, {model::JointVector::Constant(n, 0.5), {}}};
  DesignPoint point{0.5 * (space.low + space.high), 20, model::JointVector::Zero(n), 600, 1};
  point.side[2] = -1;
  CHECK(point.Extras() == 3);
  const Dataset rows = CandidateRows(data, space, {point}, data.conditions.back());
  const effects::Conditions& moment = rows.conditions.front();
  CHECK(moment.q == point.q);
  CHECK(moment.approach[2] == -1);
  CHECK(moment.last_move[2] == Approx(-space.reach[2]));
  CHECK(moment.last_move[1] == 0);
  CHECK(*moment.t_s == *data.conditions.back().t_s + 600);
  CHECK(moment.qd[0] == 0.5);
  const std::optional<model::JointVector> via = ViaPose(space, point);
  REQUIRE(via);
  CHECK((*via)[2] == Approx(point.q[2] + space.reach[2]));
  // At the end of its range a joint cannot be approached from outside.
  point.q[2] = space.high[2];
  CHECK_FALSE(Within(space, point));
  for (const DesignPoint& neighbour : Neighbours(space, point, 0.1)) {
    CHECK(Within(space, neighbour));
  }
}

TEST_CASE("the sum of the distances of a pair is the chi2 of a refit to all rows") {
  const Dataset data = Rows({20, 60});
  const Model model = Model::Declared(data);
  const Result<Linearisation> linear = LineariseApart(data, model, 1);
  REQUIRE(linear);
  // The candidate set has the first half of the rows; the second half is planned.
  FitRows seen, all;
  for (const RowIndex row : data.row_indices()) (row < RowIndex(20) ? seen : all).push_back(row);
  FitProblem fit = UnitWeightFit(data, 1).WithRows(seen);
  fit.sigma_m = kSigma_m;
  const auto shared = std::make_shared<const Linearisation>(*linear);
  const LinearProblem problem(std::move(fit), shared, model);
  CandidateSet candidate_set(problem);
  std::vector<Explanation> pair;
  for (const char* id : {"joint_offset", "base_frame"}) {
    pair.push_back(candidate_set.Fit({candidate_set.Add(BlockOf(data, id))}));
    pair.back().values.setConstant(1e-4);
  }
  pair[0].score = pair[1].score = 0;
  Discrimination discrimination(candidate_set, pair);
  CHECK_FALSE(discrimination.Separated(1));
  double sum = 0;
  for (const RowIndex row : all) {
    const double gain = discrimination.Gain(data, *linear, row);
    CHECK(gain >= 0);
    // Both directions, each up to its need plus a tenth of the excess.
    CHECK(gain <= 2 * 36 * 1.1 * (1 + 1e-12));
    CHECK(discrimination.LargestDistance(data, *linear, row) > 0);
    sum += gain;
    discrimination.Measure(data, *linear, row);
  }
  CHECK(sum >= 2 * 36);
  CHECK(sum <= 2 * 36 * 1.1);
  CHECK(discrimination.Separated(1));
  CHECK(discrimination.AllSeparated());
  CHECK(discrimination.Gain(data, *linear, all.front()) == 0);
  discrimination.Restart();
  CHECK_FALSE(discrimination.AllSeparated());
  CHECK(discrimination.Gain(data, *linear, all.front()) > 0);
}

TEST_CASE("backlash is separated from an offset by the other side of approach") {
  const TwoExplanations pair = PlayOrOffset();
  CHECK(pair.space.approached.size() == static_cast<std::size_t>(pair.space.low.size()));
  for (const effects::Conditions& moment : pair.data.conditions) REQUIRE(moment.approach[1] == 1);
  const SequentialDesign start(*pair.task, pair.space);
  DesignPoint point{0.5 * (pair.space.low + pair.space.high), 20,
                    model::JointVector::Zero(pair.space.low.size())};
  point.side[1] = 1;
  DesignPoint other = point;
  other.side[1] = -1;
  const std::vector<double> values = start.Values({point, other});
  CHECK(values[1] > 10 * values[0]);

  const PoseDesign design = pair.Design();
  CHECK(design.unseparated.empty());
  REQUIRE_FALSE(design.poses.empty());
  const NextPose& first = design.poses.front();
  const model::JointVector& from =
      first.via_q.size() > 0 ? first.via_q : pair.data.conditions.back().q;
  CHECK(first.q[1] < from[1]);
}

TEST_CASE("a drift is separated from a step by waiting") {
  const Dataset data = Rows({20});
  // Both have risen; only the drift continues.
  const Block drift = ShiftBlock("thermal_drift", "", {{0}, {1}, {2}, {3}}, 0, {0, 0, 0, 4000});
  const Block step =
      ShiftBlock("step_event", "base", {{0}, {2}, {3}, {4}}, 1, {12 * kStep_s, 0, 0, 0});
  const TwoExplanations pair(data, drift, Eigen::Vector3d(0, 0, 2.5e-4), step,
                             Eigen::Vector3d(0, 0, 1e-4));
  CHECK(pair.space.waits_s == std::vector<double>{0, 600, 2340});
  const SequentialDesign start(*pair.task, pair.space);
  DesignPoint now{pair.data.conditions.back().q, 20,
                  model::JointVector::Zero(pair.space.low.size())};
  DesignPoint later = now;
  later.wait_s = 2340;
  const std::vector<double> values = start.Values({now, later});
  CHECK(values[1] > 3 * values[0]);
  const PoseDesign design = pair.Design();
  REQUIRE_FALSE(design.poses.empty());
  CHECK(design.poses.front().wait_s > 0);
}

TEST_CASE("a delay is separated from an offset by another speed") {
  measure::MeasuredTable table = Table(Cell(), {20});
  table.recorded.qd = true;
  for (measure::MeasuredRow& row : table.rows)
    row.qd = model::JointVector::Constant(row.q.size(), 0.2);
  const Dataset data = Rows(std::move(table));
  const TwoExplanations pair(data, BlockOf(data, "latency"), Eigen::VectorXd::Constant(1, 2e-3),
                             BlockOf(data, "joint_offset"),
                             Eigen::VectorXd::Constant(data.cell.robot.size(), -2e-3 * 0.2));
  REQUIRE(pair.space.motions.size() == 3);
  CHECK(pair.space.motions.front().qd.isZero());
  const PoseDesign design = pair.Design();
  REQUIRE_FALSE(design.poses.empty());
  CHECK(design.unseparated.empty());
  REQUIRE(design.poses.front().qd.size() == data.cell.robot.size());
  CHECK(design.poses.front().qd.isZero());
}

TEST_CASE("a payload is chosen that separates two effects of the load") {
  const Dataset data = Rows({20});
  // A tenth of the payload and two kilograms are equal at a payload of 20 kg.
  const auto with = [&](int spec) {
    Block block = BlockOf(data, "payload_mass");
    block.term.parameters = {{spec}};
    block.columns.resize(1);
    block.columns.front().values = {0};
    block.units = 1;
    return block;
  };
  TwoExplanations pair(data, with(0), Eigen::VectorXd::Constant(1, 0.1), with(1),
                       Eigen::VectorXd::Constant(1, 2));
  CHECK(pair.Design().gain < 1);
  pair.space.payloads_kg = {0, 20};
  const PoseDesign design = pair.Design();
  REQUIRE_FALSE(design.poses.empty());
  CHECK(design.poses.front().payload_kg == 0);
}

TEST_CASE("coordinate exchange never lowers the value and remains within the range") {
  const TwoExplanations pair = PlayOrOffset();
  const SequentialDesign start(*pair.task, pair.space);
  const std::vector<DesignPoint> points = RandomPoints(pair.space);
  int higher = 0;
  for (std::size_t k = 0; k < points.size(); k += points.size() / 12) {
    const DesignPoint improved = start.Improved(points[k]);
    CHECK(Within(pair.space, improved));
    const std::vector<double> values = start.Values({points[k], improved});
    CHECK(values[1] >= values[0]);
    if (values[1] > values[0]) ++higher;
  }
  CHECK(higher >= 6);
}

TEST_CASE("no pose is proposed outside the joint range or below the lowest tip") {
  TwoExplanations pair = PlayOrOffset();
  double middle_m = 0;
  for (const measure::MeasuredRow& row : pair.data.table.rows) middle_m += row.measured_W->z() / 40;
  pair.task->lowest_m = middle_m;
  const PoseDesign design = pair.Design();
  REQUIRE(design.poses.size() == 6);
  DesignSpace still = pair.space;
  still.approached.clear();
  for (const NextPose& pose : design.poses) {
    for (const NextPose& other : design.poses) {
      if (&other == &pose) continue;
      const auto range = (pair.space.high - pair.space.low).array();
      CHECK(((pose.q - other.q).array().abs() / range).mean() >= 0.15);
    }
    for (const model::JointVector& q : {pose.q, pose.via_q}) {
      if (q.size() == 0) continue;
      CHECK((q.array() >= pair.space.low.array()).all());
      CHECK((q.array() <= pair.space.high.array()).all());
      CHECK(std::abs(q[0]) <= 1.0);
    }
    const DesignPoint point{pose.q, 20, model::JointVector::Zero(pose.q.size())};
    const Dataset row = CandidateRows(pair.data, still, {point}, pair.data.conditions.back());
    const Result<Linearisation> at = Linearise(row, pair.model, false, 1);
    REQUIRE(at);
    CHECK(at->rows.front().p_W.z() >= middle_m);
  }
  // Deterministic: a second run gives the same poses.
  const PoseDesign again = pair.Design();
  REQUIRE(again.poses.size() == design.poses.size());
  for (std::size_t k = 0; k < design.poses.size(); ++k) {
    CHECK(again.poses[k].q == design.poses[k].q);
  }
}

TEST_CASE(
    "the prior of joint compliance is a wind-up angle, independent of the weight of the arm") {
  const Dataset data = Rows({20});
  const TwoExplanations pair = PlayOrOffset();
  const Block block = BlockOf(data, "joint_compliance");
  const Indexed<BlockColumnIndex, double> sizes = PriorSizes(*pair.problem, block);
  REQUIRE(sizes.size() == block.columns.size());
  double most_Nm = 0;
  const deflection::LoadedArm arm(pair.data.cell);
  for (const RowIndex row : pair.data.row_indices()) {
    deflection::LoadedState state;
    REQUIRE(arm.AtCommanded(pair.data.measured(row).q, pair.data.payloads[row], nullptr,
                            pair.data.conditions[row].tau, state));
    most_Nm = std::max(most_Nm, std::abs(state.tau[1]));
  }
  constexpr BlockColumnIndex kSecond(1);
  CHECK(sizes[kSecond] == Approx(7e-3 / most_Nm).epsilon(0.02));
  CHECK(sizes[kSecond] < block.columns[kSecond].Largest());
  const Block offsets = BlockOf(data, "joint_offset");
  CHECK(PriorSizes(*pair.problem, offsets)[kSecond] == offsets.columns[kSecond].Largest());
}

TEST_CASE("the derivative of the loss is the weight, and the loss is bounded") {
  for (int count = 1; count <= kMaxResiduals; ++count) {
    for (double d = 0.05; d < 12; d += 0.1) {
      const double h = 1e-6;
      const double slope = (HampelLoss(count, d + h) - HampelLoss(count, d - h)) / (2 * h);
      CHECK(slope == Approx(2 * HampelWeight(count, d) * d).margin(1e-6));
      if (count <= 3) CHECK(HampelLoss(count, d) <= 41);
    }
  }
}

}  // namespace plumbline::next_poses_test
