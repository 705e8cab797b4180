#include "app/measure/diagnosis/shapes/shape_gain.h"

#include <Eigen/Dense>
#include <algorithm>

namespace plumbline::measure {

double Gain(const LinearProblem& problem, Eigen::MatrixXd columns,
            const Eigen::VectorXd& residual) {
  problem.Project(columns);
  Eigen::MatrixXd gram = columns.transpose() * columns;
  const Eigen::VectorXd moment = columns.transpose() * residual;
  gram.diagonal().array() += 1e-9 * gram.diagonal().maxCoeff() + 1e-300;
  return moment.dot(gram.ldlt().solve(moment));
}

std::vector<int> TranslationEntries(int first) {
  return {first, first + 1, first + 2};
}

std::vector<Block> Best(Found found, std::size_t most) {
  std::ranges::stable_sort(found, [](const auto& a, const auto& b) { return a.first > b.first; });
  if (found.size() > most) found.resize(most);
  std::vector<Block> blocks;
  blocks.reserve(found.size());
  for (auto& [gain, block] : found) blocks.push_back(std::move(block));
  return blocks;
}

}  // namespace plumbline::measure
