#include "tests/simulator/noise.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

namespace simulator {
namespace {

double OneError(const Noise& noise, Generator& random) {
  const double error = Normal(random);
  if (!noise.heavy_tails) return error;
  // Student's t with 3 degrees of freedom: variance 3, scaled to the same sigma at its quartiles.
  double square = 0.0;
  for (int i = 0; i < 3; ++i) square += std::pow(Normal(random), 2);
  return error * 0.882 / std::sqrt(square / 3.0);
}

/// Errors in units of sigma of a tracker at twice the arm's reach: the transverse error
/// grows with the distance; the error of the distance is a quarter of it and constant.
void SpreadAsTracker(const Cell& cell, const std::vector<Eigen::Vector3d>& truth_m,
                     std::vector<Eigen::Vector3d>& errors) {
  const Eigen::Vector3d tracker_m = CameraBeside(cell).at_m;
  double square = 0.0;
  for (const Eigen::Vector3d& p : truth_m) square += (p - tracker_m).squaredNorm();
  const double usual_m = std::sqrt(square / double(truth_m.size()));
  constexpr double kAlong = 0.25;
  const double scale = std::sqrt(3.0 / (2.0 + kAlong * kAlong));
  for (std::size_t k = 0; k < errors.size(); ++k) {
    const Eigen::Vector3d beam = truth_m[k] - tracker_m;
    const Eigen::Vector3d along = beam.normalized() * beam.normalized().dot(errors[k]);
    errors[k] = scale * (kAlong * along + (errors[k] - along) * beam.norm() / usual_m);
  }
}

/// Indices of outlier rows; runs in order.
std::vector<std::size_t> OutlierRows(const Noise& noise, std::size_t rows, Generator& random) {
  const auto wanted = std::size_t(std::lround(noise.outliers * double(rows)));
  std::vector<std::size_t> order(rows);
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), random);
  if (!noise.runs) {
    order.resize(wanted);
    return order;
  }
  std::set<std::size_t> chosen;
  for (const std::size_t first : order) {
    if (chosen.size() >= wanted) break;
    const auto length = std::size_t(3 + std::uniform_int_distribution<int>(0, 4)(random));
    for (std::size_t k = first; k < std::min(first + length, rows); ++k) {
      if (chosen.size() < wanted) chosen.insert(k);
    }
  }
  return {chosen.begin(), chosen.end()};
}

}  // namespace

std::vector<int> Measure(const Cell& cell, const Noise& noise,
                         const std::vector<Eigen::Vector3d>& truth_m, Table& measured,
                         Generator& random) {
  const std::size_t rows = measured.rows.size();
  std::vector<Eigen::Vector3d> errors(rows);
  const double fresh = std::sqrt(1.0 - noise.ar1 * noise.ar1);
  for (std::size_t k = 0; k < rows; ++k) {
    for (double& error : errors[k]) error = OneError(noise, random);
    if (k > 0) errors[k] = noise.ar1 * errors[k - 1] + fresh * errors[k];
  }
  if (noise.tracker) SpreadAsTracker(cell, truth_m, errors);
  for (std::size_t k = 0; k < rows; ++k) {
    measured.rows[k].xyz_m = truth_m[k] + cell.sigma_m * errors[k];
  }
  std::vector<int> lines;
  Eigen::Vector3d direction;
  for (const std::size_t k : OutlierRows(noise, rows, random)) {
    const bool goes_on = noise.runs && !lines.empty() && lines.back() == int(k) + 1;
    if (!goes_on) {
      direction = Eigen::Vector3d(Normal(random), Normal(random), Normal(random)).normalized();
    }
    measured.rows[k].xyz_m += direction * cell.sigma_m * Uniform(random, 10, 100);
    lines.push_back(int(k) + 2);
  }
  std::sort(lines.begin(), lines.end());
  return lines;
}

void MeasureAxes(const Cell& cell, const std::vector<Eigen::Matrix3d>& truth, Table& measured,
                 Generator& random) {
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const Eigen::Vector3d turn =
        cell.sigma_rad * Eigen::Vector3d(Normal(random), Normal(random), Normal(random));
    measured.rows[k].axes =
        Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() * truth[k];
  }
  measured.axes = true;
}

}  // namespace simulator
