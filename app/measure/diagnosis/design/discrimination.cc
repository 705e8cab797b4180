#include "app/measure/diagnosis/design/discrimination.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "app/measure/diagnosis/linear/fit_problem.h"
#include "app/measure/diagnosis/linear/nuisances.h"

namespace plumbline::measure {
namespace {

constexpr double kMaxSize = 1e3;  // SI; a larger plausible size means that none is given
constexpr double kMinLever =
    1e-3;  // [m/rad]; with a smaller lever arm, the rotation of a joint is not observable

/// The joint of a block's column; -1 if it belongs to none.
int JointOf(const Block& block, BlockColumnIndex column) {
  const int parameter = block.columns[column].parameter;
  return block.term.parameters[parameter].joint;
}

/// Largest rotation of its joint [rad] by one SI unit of each column, over the problem's rows: the
/// displacement of the tip divided by the lever arm of the joint.
Indexed<BlockColumnIndex, double> LargestRotations(const LinearProblem& problem,
                                                   const Block& block) {
  Eigen::MatrixXd columns;
  Indexed<BlockColumnIndex, double> largest(block.columns.size(), 0.0);
  for (const RowIndex row : problem.rows()) {
    const Gradient& gradient = problem.linear().gradients[row];
    columns.resize(gradient.rows(), block.columns.count());
    ColumnsAt(problem.data(), problem.linear(), block, row, columns);
    for (const BlockColumnIndex k : largest.indices()) {
      const int joint = JointOf(block, k);
      if (joint < 0) continue;
      const double lever =
          LengthsOf(gradient.col(effects::Influence<double>::kTurn * model::kMaxJoints + joint))
              .norm();
      if (lever < kMinLever) continue;
      largest[k] = std::max(largest[k], LengthsOf(columns.col(k.value())).norm() / lever);
    }
  }
  return largest;
}

}  // namespace

Indexed<BlockColumnIndex, double> PriorSizes(const LinearProblem& problem, const Block& block) {
  Indexed<BlockColumnIndex, double> sizes;
  sizes.reserve(block.columns.size());
  for (const BlockColumn& column : block.columns) {
    sizes.push_back(std::min(kMaxSize, column.Largest()));
  }
  const double seen_rad = block.term.effect->traits().largest_observed_rotation_rad;
  if (seen_rad == 0) return sizes;
  const Indexed<BlockColumnIndex, double> rotations_rad = LargestRotations(problem, block);
  for (const BlockColumnIndex k : sizes.indices()) {
    const int joint = JointOf(block, k);
    if (joint < 0 || !(rotations_rad[k] > 0)) continue;
    const model::Joint& link = problem.data().cell.robot.joints[joint];
    if (link.type == model::JointType::kPrismatic) continue;
    sizes[k] = std::min(sizes[k], seen_rad / rotations_rad[k]);
  }
  return sizes;
}

namespace {

constexpr double kForNoise = 2;  // [sigma] margin for noise beyond the gap that rules a rival out
constexpr double kForMargin = 0.1;  // weight of d^2 beyond the need: linear models are optimistic

}  // namespace

Discrimination::Side Discrimination::SideOf(const Explanation& explanation) const {
  Side side;
  side.blocks = explanation.blocks;
  const Coefficients found = candidate_set_.CoefficientsOf(explanation);
  std::vector<double> unit, values;
  for (const BlockIndex block : side.blocks) {
    const Indexed<BlockColumnIndex, double> prior =
        PriorSizes(candidate_set_.problem(), candidate_set_.blocks()[block]);
    for (const BlockColumnIndex k : prior.indices()) {
      const auto at = found.find({block, k});
      const double value = at == found.end() ? 0 : at->second;
      unit.push_back(std::max(prior[k], std::abs(value)));
      values.push_back(value / unit.back());
    }
  }
  side.unit = Eigen::Map<Eigen::VectorXd>(unit.data(), static_cast<int>(unit.size()));
  side.values = Eigen::Map<Eigen::VectorXd>(values.data(), static_cast<int>(values.size()));
  return side;
}

Discrimination::Discrimination(const CandidateSet& candidate_set,
                               const std::vector<Explanation>& explanations)
    : candidate_set_(candidate_set) {
  const auto n = static_cast<int>(explanations.size());
  needed_ = reached_ = Eigen::MatrixXd::Zero(n, n);
  double best = explanations.front().score;
  for (const Explanation& explanation : explanations) best = std::min(best, explanation.score);
  for (int i = 0; i < n; ++i) {
    const Explanation& explanation = explanations[i];
    sides_.push_back(SideOf(explanation));
    sides_.back().weight = std::exp((best - explanation.score) / 2);
    for (int j = 0; j < n; ++j) {
      const double ahead = explanations[j].score - explanation.score;
      if (i != j && ahead < kRivalGap) {
        needed_(i, j) = std::pow(std::sqrt(kRivalGap - ahead) + kForNoise, 2);
      }
    }
  }
  for (const RowIndex row : candidate_set.problem().rows()) {
    Add(At(candidate_set.problem().data(), candidate_set.problem().linear(), row));
  }
  Solve();
}

Discrimination::AtRow Discrimination::At(const Dataset& data, const Linearisation& linear,
                                         RowIndex row) const {
  const Nuisances nuisances(data);
  const int count = linear.layout.count(row);
  const RowWhitening whitening(data.numbers[row], 1 / candidate_set_.problem().sigma_m());
  AtRow result;
  result.fields.resize(count, static_cast<int>(sides_.size()));
  for (const Side& side : sides_) {
    const auto own = side.unit.size();
    Eigen::MatrixXd X = Eigen::MatrixXd::Zero(count, own + nuisances.size());
    Eigen::Index at = 0;
    for (const BlockIndex block : side.blocks) {
      const Block& added = candidate_set_.blocks()[block];
      Eigen::MatrixXd columns(count, added.columns.count());
      ColumnsAt(data, linear, added, row, columns);
      X.middleCols(at, columns.cols()) = columns;
      at += columns.cols();
    }
    X.leftCols(own) *= side.unit.asDiagonal();
    nuisances.Fill(linear.rows[row], row, X.rightCols(nuisances.size()));
    whitening.Apply(X.eval(), X);
    result.fields.col(static_cast<int>(result.X.size())) = X.leftCols(own) * side.values;
    result.X.push_back(std::move(X));
  }
  return result;
}

void Discrimination::Add(const AtRow& at) {
  for (std::size_t j = 0; j < sides_.size(); ++j) {
    Side& side = sides_[j];
    const Eigen::MatrixXd& X = at.X[j];
    if (side.H.size() == 0) {
      side.H = Eigen::MatrixXd::Identity(X.cols(), X.cols());
      side.g = Eigen::MatrixXd::Zero(X.cols(), at.fields.cols());
    }
    side.H += X.transpose() * X;
    side.g += X.transpose() * at.fields;
  }
}

void Discrimination::Solve() {
  for (Side& side : sides_) {
    side.solver.compute(side.H);
    side.theta = side.solver.solve(side.g);
  }
}

Eigen::MatrixXd Discrimination::Distances(const AtRow& at) const {
  Eigen::MatrixXd distances(needed_.rows(), needed_.cols());
  for (std::size_t j = 0; j < sides_.size(); ++j) {
    const Eigen::MatrixXd& X = at.X[j];
    const Eigen::MatrixXd e = at.fields - X * sides_[j].theta;
    const Eigen::MatrixXd S =
        Eigen::MatrixXd::Identity(X.rows(), X.rows()) + X * sides_[j].solver.solve(X.transpose());
    distances.col(static_cast<int>(j)) =
        e.cwiseProduct(S.ldlt().solve(e)).colwise().sum().transpose();
  }
  return distances;
}

double Discrimination::Gain(const Dataset& candidates, const Linearisation& linear,
                            RowIndex row) const {
  const Eigen::MatrixXd distances = Distances(At(candidates, linear, row));
  double gain = 0;
  for (Eigen::Index i = 0; i < distances.rows(); ++i) {
    for (Eigen::Index j = 0; j < distances.cols(); ++j) {
      const double missing = needed_(i, j) - reached_(i, j);
      if (missing <= 0) continue;
      const double beyond = std::clamp(distances(i, j) - missing, 0.0, needed_(i, j));
      gain += sides_[i].weight * (std::min(distances(i, j), missing) + kForMargin * beyond);
    }
  }
  return gain;
}

double Discrimination::LargestDistance(const Dataset& candidates, const Linearisation& linear,
                                       RowIndex row) const {
  const AtRow at = At(candidates, linear, row);
  double farthest = 0;
  for (std::size_t j = 1; j < sides_.size(); ++j) {
    const Eigen::VectorXd apart = at.fields.col(0) - at.X[j] * sides_[j].theta.col(0);
    // Lengths only; the orientation residuals of a pose are not in millimetres.
    const auto lengths = std::min<Eigen::Index>(apart.size(), kMaxLengths);
    farthest = std::max(farthest, apart.head(lengths).norm());
  }
  return farthest * candidate_set_.problem().sigma_m();
}

void Discrimination::Measure(const Dataset& candidates, const Linearisation& linear, RowIndex row) {
  const AtRow at = At(candidates, linear, row);
  reached_ += Distances(at);
  Add(at);
  Solve();
}

bool Discrimination::Separated(std::size_t rival) const {
  const auto j = static_cast<int>(rival);
  return reached_(0, j) >= needed_(0, j) && reached_(j, 0) >= needed_(j, 0);
}

bool Discrimination::AllSeparated() const {
  for (std::size_t j = 1; j < sides_.size(); ++j) {
    if (!Separated(j)) return false;
  }
  return true;
}

}  // namespace plumbline::measure
