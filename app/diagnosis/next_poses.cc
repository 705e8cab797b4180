#include "app/diagnosis/next_poses.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "app/diagnosis/statistics.h"

namespace plumbline {
namespace {

constexpr int kCandidates = 300;

struct PoseRange {
  JointVector low, high;
};

PoseRange RangeOf(const Dataset& data) {
  PoseRange range{data.table.rows.front().q, data.table.rows.front().q};
  for (const MeasuredRow& row : data.table.rows) {
    range.low = range.low.cwiseMin(row.q);
    range.high = range.high.cwiseMax(row.q);
  }
  for (int i = 0; i < data.cell.robot.size(); ++i) {
    const Joint& joint = data.cell.robot.joints[static_cast<std::size_t>(i)];
    if (std::isfinite(joint.min) && std::isfinite(joint.max)) {
      range.low[i] = joint.min;
      range.high[i] = joint.max;
    }
  }
  return range;
}

/// The data's rows replaced by candidate poses; signals that a commissioner cannot choose stand at
/// the middle of what was seen.
Dataset AtCandidates(const Dataset& data) {
  Dataset candidates = data;
  candidates.table.rows.clear();
  candidates.conditions.clear();
  candidates.payloads.clear();
  candidates.session_of.clear();
  candidates.cluster_of.clear();
  candidates.clusters = 0;
  const PoseRange range = RangeOf(data);
  std::vector<double> loads = {0.0};
  double heaviest = 0;
  for (const Payload& payload : data.payloads) heaviest = std::max(heaviest, payload.mass_kg);
  if (heaviest > 0) loads = {0.0, heaviest / 2, heaviest};
  Random random(4242);
  for (int k = 0; k < kCandidates; ++k) {
    const auto like = static_cast<std::size_t>(random.Below(data.rows()));
    MeasuredRow row = data.table.rows[like];
    for (Eigen::Index i = 0; i < row.q.size(); ++i) {
      row.q[i] = range.low[i] + random.Uniform() * (range.high[i] - range.low[i]);
    }
    row.payload_kg = loads[static_cast<std::size_t>(random.Below(static_cast<int>(loads.size())))];
    Conditions moment = data.conditions[like];
    moment.q = row.q;
    moment.payload_kg = row.payload_kg;
    moment.tau.resize(0);
    moment.approach = JointVector::Zero(row.q.size());
    for (Eigen::Index i = 0; i < row.q.size(); ++i) moment.approach[i] = random.Sign();
    candidates.payloads.push_back({row.payload_kg, data.payloads[like].cog_F});
    if (data.cell.payload_cog_F && heaviest > 0)
      candidates.payloads.back().cog_F = *data.cell.payload_cog_F;
    candidates.session_of.push_back(data.session_of[like]);
    candidates.cluster_of.push_back(candidates.clusters++);
    candidates.conditions.push_back(std::move(moment));
    candidates.table.rows.push_back(std::move(row));
  }
  // Signals of empirical terms stay those of rows that exist.
  for (RecordedSignal& signal : candidates.signals) signal.values.assign(kCandidates, signal.low);
  return candidates;
}

/// Columns of an explanation's kept parameters at a row, in sigma.
Eigen::MatrixXd ColumnsOf(const Pool& pool, const Explanation& explanation, const Dataset& data,
                          const Linearisation& linear, int row) {
  const auto coefficients = pool.CoefficientsOf(explanation);
  Eigen::MatrixXd columns(linear.axes, static_cast<int>(coefficients.size()));
  int at = 0;
  int last_block = -1;
  Eigen::MatrixXd of_block;
  for (const auto& [key, value] : coefficients) {
    const Block& block = pool.blocks()[static_cast<std::size_t>(key.first)];
    if (key.first != last_block) {
      of_block.resize(3, static_cast<int>(block.columns.size()));
      ColumnsAt(data, linear, block, row, of_block);
      last_block = key.first;
    }
    columns.col(at++) = of_block.col(key.second).head(linear.axes) / pool.problem().sigma_m();
  }
  return columns;
}

Eigen::VectorXd ValuesOf(const Pool& pool, const Explanation& explanation) {
  const auto coefficients = pool.CoefficientsOf(explanation);
  Eigen::VectorXd values(static_cast<int>(coefficients.size()));
  int at = 0;
  for (const auto& [key, value] : coefficients) values[at++] = value;
  return values;
}

/// One rival's fight against the answer: what it could still imitate after the rows so far.
struct Contest {
  Eigen::MatrixXd H;  ///< information on the rival's columns and the frames
  Eigen::VectorXd g;
};

}  // namespace

std::vector<NextPose> NextPoses(const Pool& pool, const Model& model, const Explanation& answer,
                                const std::vector<Explanation>& rivals, int count, int threads) {
  const Dataset& data = pool.problem().data();
  const Dataset candidates = AtCandidates(data);
  const Result<Linearisation> linear = Linearise(candidates, model, true, threads);
  if (!linear || rivals.empty()) return {};
  const int frames = (data.frames_free() ? 6 : 0) + (data.tip_free() ? 3 : 0);
  const auto rival_columns = [&](const Explanation& rival, const Dataset& of,
                                 const Linearisation& at, int row) {
    const Eigen::MatrixXd columns = ColumnsOf(pool, rival, of, at, row);
    Eigen::MatrixXd all(at.axes, columns.cols() + frames);
    all.leftCols(columns.cols()) = columns;
    const auto& derivative = at.rows[static_cast<std::size_t>(row)].frames;
    if (data.frames_free())
      all.middleCols(columns.cols(), 6) =
          derivative.topLeftCorner(at.axes, 6) / pool.problem().sigma_m();
    if (data.tip_free())
      all.rightCols(3) = derivative.topRightCorner(at.axes, 3) / pool.problem().sigma_m();
    return all;
  };
  const Eigen::VectorXd values = ValuesOf(pool, answer);
  std::vector<Contest> contests;
  for (const Explanation& rival : rivals) {
    Contest contest;
    for (const int row : pool.problem().rows()) {
      const Eigen::MatrixXd X = rival_columns(rival, data, pool.problem().linear(), row);
      const Eigen::VectorXd field =
          ColumnsOf(pool, answer, data, pool.problem().linear(), row) * values;
      if (contest.H.size() == 0) {
        contest.H = Eigen::MatrixXd::Zero(X.cols(), X.cols());
        contest.g = Eigen::VectorXd::Zero(X.cols());
      }
      contest.H += X.transpose() * X;
      contest.g += X.transpose() * field;
    }
    contest.H.diagonal().array() *= 1 + 1e-9;
    contest.H.diagonal().array() += 1e-12;
    contests.push_back(std::move(contest));
  }
  std::vector<NextPose> poses;
  std::vector<bool> taken(static_cast<std::size_t>(kCandidates), false);
  for (int pick = 0; pick < count; ++pick) {
    double best = 0;
    int best_row = -1;
    std::vector<Eigen::LDLT<Eigen::MatrixXd>> solvers;
    for (const Contest& contest : contests) solvers.emplace_back(contest.H);
    for (int row = 0; row < kCandidates; ++row) {
      if (taken[static_cast<std::size_t>(row)]) continue;
      // A tip below the base's plane cannot be measured in most cells.
      if (linear->rows[static_cast<std::size_t>(row)].p_W.z() < model.frames[0].X_WB.p.z())
        continue;
      const Eigen::VectorXd field = ColumnsOf(pool, answer, candidates, *linear, row) * values;
      double least = 1e300;
      for (std::size_t r = 0; r < rivals.size(); ++r) {
        const Eigen::MatrixXd X = rival_columns(rivals[r], candidates, *linear, row);
        const Eigen::VectorXd e = field - X * solvers[r].solve(contests[r].g);
        const Eigen::MatrixXd S =
            Eigen::MatrixXd::Identity(e.size(), e.size()) + X * solvers[r].solve(X.transpose());
        least = std::min(least, e.dot(S.ldlt().solve(e)));
      }
      if (least > best) {
        best = least;
        best_row = row;
      }
    }
    if (best_row < 0) break;
    taken[static_cast<std::size_t>(best_row)] = true;
    const auto at = static_cast<std::size_t>(best_row);
    const Eigen::VectorXd field = ColumnsOf(pool, answer, candidates, *linear, best_row) * values;
    for (std::size_t r = 0; r < rivals.size(); ++r) {
      const Eigen::MatrixXd X = rival_columns(rivals[r], candidates, *linear, best_row);
      contests[r].H += X.transpose() * X;
      contests[r].g += X.transpose() * field;
    }
    poses.push_back({candidates.table.rows[at].q, candidates.table.rows[at].payload_kg,
                     std::sqrt(best) * pool.problem().sigma_m()});
  }
  return poses;
}

}  // namespace plumbline
