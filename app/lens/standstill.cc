#include "app/lens/standstill.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

namespace plumbline {
namespace {

// Views on either side of a jump that may add to the doubt: of fewer, chance makes anything.
constexpr std::size_t kLeastBeside = 3;
// chi^2 of the focal length that one simulated capture in three reaches where nothing moved.
constexpr double kOfChance = 4;

/// How the shared parameters may change: a column for each degree of freedom.
using Directions = Eigen::Matrix<double, kSharedCount, Eigen::Dynamic>;

Directions DirectionsOf(Change::Of of, const SharedVector& shared) {
  Directions D = Directions::Zero(kSharedCount, static_cast<int>(of) + 1);
  switch (of) {
    case Change::Of::kFocalLength:
      D(kFx, 0) = shared[kFx];
      D(kFy, 0) = shared[kFy];
      break;
    case Change::Of::kCentre:
      D(kCx, 0) = D(kCy, 1) = 1;
      break;
    case Change::Of::kBoard:
      D(kBowX, 0) = D(kBowY, 1) = D(kBowXY, 2) = 1;
      break;
  }
  return D;
}

/// Covariance of the shared parameters with the dropped ones held.
SharedMatrix CovarianceOfHeld(const LensFit& fit) {
  const SharedVector sd = fit.covariance.diagonal().cwiseSqrt();
  SharedMatrix information =
      sd.asDiagonal() * SharedMatrix(fit.covariance.inverse()) * sd.asDiagonal();
  for (int k = 0; k < kSharedCount; ++k) {
    if (!fit.dropped[k]) continue;
    information.row(k).setZero();
    information.col(k).setZero();
    information(k, k) = 1;
  }
  SharedMatrix covariance = information.inverse();
  for (int k = 0; k < kSharedCount; ++k) {
    if (fit.dropped[k]) covariance(k, k) = 0;
  }
  return sd.asDiagonal() * covariance * sd.asDiagonal();
}

/// How a change may run over the views.
struct Course {
  bool steady = false;
  std::size_t at = 0;
  std::vector<double> w;
};

std::vector<Course> AllCourses(std::span<const BoardView> views) {
  std::vector<Course> courses;
  const double first = views.front().time_s, span = views.back().time_s - first;
  if (span > 0) {
    Course steady{true, 0, {}};
    for (const BoardView& view : views) steady.w.push_back((view.time_s - first) / span - 0.5);
    courses.push_back(std::move(steady));
  }
  for (std::size_t at = 1; at < views.size(); ++at) {
    Course jump{false, at, std::vector<double>(views.size(), 0.5)};
    std::fill_n(jump.w.begin(), at, -0.5);
    courses.push_back(std::move(jump));
  }
  return courses;
}

/// A course tried: its change, and how far the lens fitted lies off.
struct Trial {
  Change change;
  LensMatrix square = LensMatrix::Zero();  ///< e e^T
};

Trial Try(const LensFit& fit, const SharedMatrix& C, const Course& course, const Directions& D,
          double widening) {
  SharedMatrix A = SharedMatrix::Zero(), square = SharedMatrix::Zero();
  SharedVector pull = SharedVector::Zero();
  for (std::size_t j = 0; j < course.w.size(); ++j) {
    A += course.w[j] * fit.told[j].information;
    square += course.w[j] * course.w[j] * fit.told[j].information;
    pull += course.w[j] * fit.told[j].pull;
  }
  const Eigen::VectorXd S = D.transpose() * pull;
  const Eigen::MatrixXd V = D.transpose() * (square - A * C * A) * D;
  const Eigen::VectorXd d = V.ldlt().solve(S);
  Trial trial;
  trial.change.steady = course.steady;
  trial.change.at = course.at;
  trial.change.chi2 = std::max(0.0, S.dot(d) / widening);
  trial.change.by = D * d;
  const SharedVector bias = C * A * trial.change.by;
  const SharedVector last = 0.5 * trial.change.by - bias, first = -0.5 * trial.change.by - bias;
  const auto e = (std::abs(last[kFx]) > std::abs(first[kFx]) ? last : first).head<kLensCount>();
  trial.square = e * e.transpose();
  return trial;
}

}  // namespace

Standstill StandstillOf(const LensFit& fit, std::span<const BoardView> views, double widening) {
  Standstill standstill;
  const SharedMatrix C = CovarianceOfHeld(fit);
  const std::vector<Course> courses = AllCourses(views);
  double doubted = kOfChance;
  for (std::size_t k = 0; k < standstill.changes.size(); ++k) {
    Change& change = standstill.changes[k];
    change.of = static_cast<Change::Of>(k);
    const Directions D = DirectionsOf(change.of, fit.shared);
    for (const Course& course : courses) {
      Trial trial = Try(fit, C, course, D, widening);
      const double chi2 = trial.change.chi2;
      const bool early = course.at<kLeastBeside, late = course.at + kLeastBeside> views.size();
      if (change.of == Change::Of::kFocalLength && chi2 > doubted &&
          (course.steady || (!early && !late))) {
        doubted = chi2;
        standstill.doubt = (1 - kOfChance / chi2) * trial.square;
      }
      if (!(chi2 > change.chi2)) continue;
      trial.change.of = change.of;
      change = trial.change;
    }
    change.chance = ChanceOfScan(change.chi2, static_cast<int>(D.cols()),
                                 1 / static_cast<double>(views.size()));
  }
  return standstill;
}

double ChanceOfScan(double chi2, int freedom, double first) {
  if (!(chi2 > freedom) || !(first < 0.5)) return 1;
  const double p = 0.5 * freedom, L = 2 * std::log((1 - first) / first);
  const double density = std::pow(0.5 * chi2, p) * std::exp(-0.5 * chi2) / std::tgamma(p);
  return std::min(1.0, density * (L * (1 - freedom / chi2) + 4 / chi2));
}

}  // namespace plumbline
