#include "app/measure/diagnosis/linear/empirical_columns.h"

#include <cmath>

namespace plumbline::measure {
namespace {

using I = effects::Influence<double>;
constexpr int kMaxVectorDegree = 7;  // degree of a vector-valued curve along a joint's signal
constexpr double kLeastLink_m = 0.05;

int EntryOf(I::JointEntry entry, int joint) {
  return entry * model::kMaxJoints + joint;
}

}  // namespace

std::vector<std::vector<int>> Carriers(const Dataset& data) {
  std::vector<std::vector<int>> carriers = {{I::kBase, I::kBase + 1, I::kBase + 2},
                                            {I::kBaseTilt, I::kBaseTilt + 1},
                                            {I::kTip, I::kTip + 1, I::kTip + 2}};
  if (data.cell.any_tool_bends()) carriers.push_back({I::kBendRatio});
  for (int joint = 0; joint < data.cell.robot.size(); ++joint) carriers.push_back({joint});
  for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
    const model::Joint& link = data.cell.robot.joints[joint];
    const bool slides = link.type == model::JointType::kPrismatic;  // then d is the joint itself
    if (std::abs(link.a_m) >= kLeastLink_m) carriers.push_back({EntryOf(I::kLengthA, joint)});
    if (!slides && std::abs(link.d_m) >= kLeastLink_m)
      carriers.push_back({EntryOf(I::kOffsetD, joint)});
  }
  return carriers;
}

bool MayFollow(const std::vector<int>& carrier, const RecordedSignal& signal) {
  const bool of_link = carrier.front() >= EntryOf(I::kLengthA, 0) && carrier.front() < I::kFirst;
  return !of_link || !signal.of_joint;
}

std::vector<int> Degrees(const RecordedSignal& signal, std::size_t carriers) {
  std::vector<int> degrees;
  for (const int degree : {1, 2, 3, 4, 5, 7, 10, 14}) {
    if (carriers > 1 && signal.of_joint && degree > kMaxVectorDegree) continue;
    if (degree <= 2 ? degree < signal.distinct : 2 * degree < signal.distinct) {
      degrees.push_back(degree);
    }
  }
  return degrees;
}

bool IsFreeFrame(const Dataset& data, const std::vector<int>& carrier) {
  if (carrier.front() == I::kBase || carrier.front() == I::kBaseTilt) return data.frames_free();
  if (carrier.front() == I::kTip) return data.tip_free();
  return false;
}

Eigen::MatrixXd Polynomials(const LinearProblem& problem, const std::vector<FitRowIndex>& rows,
                            SignalIndex signal, int last) {
  const RecordedSignal& driver = problem.data().signals[signal];
  Eigen::MatrixXd factors(static_cast<Eigen::Index>(rows.size()), last + 1);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const double x = Scaled(driver, driver.values[problem.rows()[rows[k]]]);
    for (int degree = 0; degree <= last; ++degree) {
      factors(static_cast<Eigen::Index>(k), degree) = Legendre(degree, x);
    }
  }
  return factors;
}

Eigen::MatrixXd SurfaceFactors(const LinearProblem& problem, const std::vector<FitRowIndex>& rows,
                               const SignalPair& pair, int degree, bool with_constant) {
  const Eigen::MatrixXd first = Polynomials(problem, rows, pair.first, degree);
  const Eigen::MatrixXd second = Polynomials(problem, rows, pair.second, degree);
  const auto degrees = SurfaceDegrees(degree, with_constant);
  Eigen::MatrixXd factors(first.rows(), static_cast<Eigen::Index>(degrees.size()));
  Eigen::Index column = 0;
  for (const auto& [a, b] : degrees) {
    factors.col(column++) = first.col(a).cwiseProduct(second.col(b));
  }
  return factors;
}

NestedFits::NestedFits(const Eigen::MatrixXd& gram)
    : L_(Eigen::MatrixXd::Zero(gram.rows(), gram.cols())) {
  constexpr double kDependent = 1e-9;
  for (int k = 0; k < gram.cols(); ++k) {
    const auto r = static_cast<int>(kept_.size());
    Eigen::VectorXd row(r);
    double pivot = gram(k, k);
    for (int i = 0; i < r; ++i) {
      row[i] = (gram(k, kept_[i]) - row.head(i).dot(L_.row(i).head(i))) / L_(i, i);
      pivot -= row[i] * row[i];
    }
    if (pivot > kDependent * gram(k, k) && pivot > 0) {
      L_.row(r).head(r) = row.transpose();
      L_(r, r) = std::sqrt(pivot);
      kept_.push_back(k);
    }
    rank_.push_back(static_cast<int>(kept_.size()));
  }
}

std::vector<double> NestedFits::Gains(const Eigen::VectorXd& moments) const {
  Eigen::VectorXd along(static_cast<Eigen::Index>(kept_.size()));
  std::vector<double> gains;
  double gain = 0;
  for (std::size_t k = 0; k < rank_.size(); ++k) {
    const auto r = static_cast<Eigen::Index>(rank_[k]) - 1;
    if (r >= 0 && kept_[r] == static_cast<int>(k)) {
      along[r] =
          (moments[static_cast<Eigen::Index>(k)] - L_.row(r).head(r).dot(along.head(r))) / L_(r, r);
      gain += along[r] * along[r];
    }
    gains.push_back(gain);
  }
  return gains;
}

}  // namespace plumbline::measure
