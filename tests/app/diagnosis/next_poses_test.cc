// Where to measure next: the candidates, the pairs' distances, and the loss behind robust weights.
#include <catch2/catch.hpp>
#include <set>

#include "app/diagnosis/alignment.h"
#include "app/diagnosis/contest.h"
#include "app/diagnosis/identify.h"
#include "app/diagnosis/pose_candidates.h"
#include "app/diagnosis/robust.h"
#include "app/diagnosis/statistics.h"
#include "tests/firmware-like/test_cell.h"

using namespace plumbline;
using plumbline::test::HeavyArm;

namespace {

/// Forty poses of the heavy arm at one payload, its rows' tips those of the declared model.
Dataset Rows(const std::vector<double>& payloads_kg) {
  CellModel cell = HeavyArm();
  cell.measurement.sigma_m = 5e-5;
  cell.robot.joints[0].min = -1.0;
  cell.robot.joints[0].max = 1.0;
  MeasuredTable table;
  table.file = "rows";
  table.recorded.position = table.recorded.payload = table.recorded.time = true;
  Random random(7);
  for (int k = 0; k < 40; ++k) {
    MeasuredRow row;
    row.line = k + 2;
    row.t_s = 60 * k;
    row.q.setZero(cell.robot.size());
    for (Eigen::Index i = 0; i < row.q.size(); ++i) row.q[i] = 1.8 * (random.Uniform() - 0.5);
    row.payload_kg = payloads_kg[static_cast<std::size_t>(k) % payloads_kg.size()];
    table.rows.push_back(row);
  }
  Result<Dataset> data = DatasetFrom(cell, table);
  REQUIRE(data);
  const Result<Linearisation> tips = Linearise(*data, Model::Declared(*data), false, 1);
  REQUIRE(tips);
  for (std::size_t k = 0; k < table.rows.size(); ++k) table.rows[k].p_WT = tips->rows[k].p_W;
  data = DatasetFrom(cell, table);
  REQUIRE(data);
  return *data;
}

}  // namespace

TEST_CASE("candidates stay where the robot has worked, within its limits, at the payloads asked") {
  const Dataset data = Rows({20, 20, 60});
  CHECK(PayloadsSeen(data) == std::vector<double>{20, 60});
  const Dataset candidates = PoseCandidates(data, {0, 60});
  REQUIRE(candidates.rows() >= 400);
  std::set<double> payloads;
  for (std::size_t k = 0; k < candidates.table.rows.size(); ++k) {
    const MeasuredRow& row = candidates.table.rows[k];
    payloads.insert(row.payload_kg);
    CHECK(candidates.payloads[k].mass_kg == row.payload_kg);
    CHECK(candidates.conditions[k].payload_kg == row.payload_kg);
    CHECK(candidates.conditions[k].q == row.q);
    CHECK(candidates.conditions[k].t_s == data.conditions.back().t_s);
    CHECK(std::abs(row.q[0]) <= 1.0);
    for (Eigen::Index i = 1; i < row.q.size(); ++i) CHECK(std::abs(row.q[i]) <= 0.9 * 1.5);
  }
  CHECK(payloads == std::set<double>{0, 60});
}

TEST_CASE("a candidate is reached from the pose before it; a joint that stays keeps its side") {
  const Dataset data = Rows({20});
  Dataset candidates = PoseCandidates(data, {20});
  Conditions previous = data.conditions.back();
  previous.approach = JointVector::Constant(previous.q.size(), -1.0);
  previous.q[2] = candidates.conditions[0].q[2];
  previous.q[3] = candidates.conditions[0].q[3] - 0.1;
  previous.q[4] = candidates.conditions[0].q[4] + 0.1;
  ComeFrom(previous, candidates);
  CHECK(candidates.conditions[0].approach[2] == -1.0);
  CHECK(candidates.conditions[0].approach[3] == 1.0);
  CHECK(candidates.conditions[0].approach[4] == -1.0);
  CHECK(candidates.conditions[0].last_move[3] == Approx(0.1));
}

TEST_CASE("the sum of a pair's distances is the chi2 that a refit to all rows leaves") {
  const Dataset data = Rows({20, 60});
  const Model model = Model::Declared(data);
  const Result<Linearisation> linear = LineariseApart(data, model, 1);
  REQUIRE(linear);
  // The pool sees the first half; the second half is what is going to be measured.
  std::vector<int> seen, all;
  for (int k = 0; k < data.rows(); ++k) (k < 20 ? seen : all).push_back(k);
  const std::vector<double> whole(static_cast<std::size_t>(data.rows()), 1.0);
  const auto shared = std::make_shared<const Linearisation>(*linear);
  const LinearProblem problem(data, shared, model, seen, whole, 5e-5, 1);
  Pool pool(problem);
  const Candidates offered = CandidatesFor(data);
  std::vector<Explanation> pair;
  for (const char* id : {"joint_offset", "base_frame"}) {
    for (const Block& block : offered.blocks) {
      if (block.id != id) continue;
      pair.push_back(pool.Fit({pool.Add(block)}));
      pair.back().values.setConstant(1e-4);
    }
  }
  REQUIRE(pair.size() == 2);
  pair[0].score = pair[1].score = 0;
  Contests contests(pool, pair);
  CHECK_FALSE(contests.Told(1));
  double sum = 0;
  for (const int row : all) {
    const double gain = contests.Gain(data, *linear, row);
    CHECK(gain >= 0);
    CHECK(gain <= 2 * 36 * (1 + 1e-12));  // both ways, each no more than it needs
    CHECK(contests.Apart(data, *linear, row) > 0);
    sum += gain;
    contests.Measure(data, *linear, row);
  }
  CHECK(sum == Approx(2 * 36));
  CHECK(contests.Told(1));
  CHECK(contests.AllTold());
  CHECK(contests.Gain(data, *linear, all.front()) == 0);
  contests.Forget();
  CHECK_FALSE(contests.AllTold());
  CHECK(contests.Gain(data, *linear, all.front()) > 0);
}

TEST_CASE("the loss is what the weights are the slope of, and bounded") {
  for (const int axes : {1, 3}) {
    for (double d = 0.05; d < 12; d += 0.1) {
      const auto loss = [&](double at) { return HampelLoss({Vec3(at, 0, 0)}, 1.0, axes); };
      const double weight = HampelWeights({Vec3(d, 0, 0)}, 1.0, axes).front();
      const double h = 1e-6;
      CHECK((loss(d + h) - loss(d - h)) / (2 * h) == Approx(2 * weight * d).margin(1e-6));
      CHECK(loss(d) <= 41);
    }
  }
}
