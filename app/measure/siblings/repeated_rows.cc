#include "app/measure/siblings/repeated_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "app/base/text/sha256.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::measure {
namespace {

constexpr double kLeastTolerance = 1e-6;  // [rad] or [m]
constexpr double kTurn = 2 * std::numbers::pi;

/// Half a unit of the last decimal that all values need, written in a unit: the most that rounding
/// to it changes a value, in SI.
class Rounding {
 public:
  explicit Rounding(double unit) : unit_(unit) {}

  void Add(double value) {
    constexpr int kMost = 9;
    for (; decimals_ < kMost; ++decimals_) {
      const double scaled = value / unit_ * std::pow(10.0, decimals_);
      // Conversion to SI and back costs some units in the last place.
      if (std::abs(scaled - std::round(scaled)) < 1e-11 * std::abs(scaled) + 1e-7) return;
    }
  }
  double Tolerance() const {
    constexpr double kHalfAUnit = 0.5 * (1 + 1e-6);
    return std::max(kLeastTolerance, kHalfAUnit * unit_ * std::pow(10.0, -decimals_));
  }

 private:
  double unit_;
  int decimals_ = 0;
};

/// Tolerances due to the written digits of a set.
struct Tolerances {
  double angle_rad = kLeastTolerance, length_m = kLeastTolerance, reading_m = kLeastTolerance;
};

bool IsRevolute(const std::vector<model::Joint>& joints, Eigen::Index i) {
  return joints[i].type == model::JointType::kRevolute;
}

Tolerances TolerancesOf(const MeasuredTable& set, const std::vector<model::Joint>& joints) {
  constexpr double kCoarsest_m = 2.5e-5;
  Rounding angle(kRadPerDeg), length(kMetrePerMm), reading(kMetrePerMm);
  for (const MeasuredRow& row : set.rows) {
    for (Eigen::Index i = 0; i < row.q.size(); ++i) {
      (IsRevolute(joints, i) ? angle : length).Add(row.q[i]);
    }
    if (row.measured_W) {
      for (const double coordinate : *row.measured_W) reading.Add(coordinate);
    }
    for (const auto& one : {row.range_m, row.gauge_m}) {
      if (one) reading.Add(*one);
    }
  }
  return {angle.Tolerance(), length.Tolerance(), std::min(reading.Tolerance(), kCoarsest_m)};
}

/// True if both are absent, or differ by no more than a tolerance.
bool Same(const std::optional<double>& a, const std::optional<double>& b, double tolerance) {
  return a.has_value() == b.has_value() && (!a || std::abs(*a - *b) <= tolerance);
}

bool SameRow(const MeasuredRow& a, const MeasuredRow& b, const std::vector<model::Joint>& joints,
             const Tolerances& within) {
  if (a.artefact != b.artefact || a.measured_W.has_value() != b.measured_W.has_value())
    return false;
  if (a.measured_W && (*a.measured_W - *b.measured_W).cwiseAbs().maxCoeff() > within.reading_m) {
    return false;
  }
  if (!Same(a.range_m, b.range_m, within.reading_m)) return false;
  if (!Same(a.gauge_m, b.gauge_m, within.reading_m)) return false;
  for (Eigen::Index i = 0; i < a.q.size(); ++i) {
    const bool revolute = IsRevolute(joints, i);
    const double apart = revolute ? std::remainder(a.q[i] - b.q[i], kTurn) : a.q[i] - b.q[i];
    if (std::abs(apart) > (revolute ? within.angle_rad : within.length_m)) return false;
  }
  return true;
}

/// The step of a grid that a value is in. Its borders lie between values of few decimals, which
/// conversion to SI and back would otherwise move from one step to the next.
std::string StepText(double value, double step, std::optional<double> period = std::nullopt) {
  constexpr double kShift = 0.2618;  // of a step
  double steps = value / step + kShift;
  if (period) {
    const double turn = std::round(*period / step);
    steps -= turn * std::floor(steps / turn);
  }
  return fmt::format(";{:.0f}", std::floor(steps));
}

/// A reading by which the rows are sorted.
double SortedBy(const MeasuredRow& row) {
  if (row.measured_W) return row.measured_W->x();
  return row.range_m.value_or(row.gauge_m.value_or(0));
}

}  // namespace

std::size_t RepeatedRows(const MeasuredTable& a, const MeasuredTable& b,
                         const std::vector<model::Joint>& joints) {
  const auto fits = [&](const MeasuredTable& set) {
    return set.rows.empty() ||
           set.rows.front().q.size() == static_cast<Eigen::Index>(joints.size());
  };
  if (!fits(a) || !fits(b)) return 0;  // another arm
  const Tolerances of_a = TolerancesOf(a, joints), of_b = TolerancesOf(b, joints);
  const Tolerances within{std::max(of_a.angle_rad, of_b.angle_rad),
                          std::max(of_a.length_m, of_b.length_m),
                          std::max(of_a.reading_m, of_b.reading_m)};
  std::multimap<double, const MeasuredRow*> left;
  for (const MeasuredRow& row : a.rows) left.emplace(SortedBy(row), &row);
  std::size_t repeated = 0;
  for (const MeasuredRow& row : b.rows) {
    const double at = SortedBy(row);
    const auto end = left.upper_bound(at + within.reading_m);
    const auto found = std::find_if(
        left.lower_bound(at - within.reading_m), end,
        [&](const auto& other) { return SameRow(*other.second, row, joints, within); });
    if (found == end) continue;
    left.erase(found);
    ++repeated;
  }
  return repeated;
}

bool IsRepeated(std::size_t repeated, std::size_t rows_a, std::size_t rows_b) {
  constexpr std::size_t kLeast = 3, kShare = 10;
  return repeated >= kLeast && kShare * repeated > std::min(rows_a, rows_b);
}

std::vector<std::string> RowDigests(const MeasuredTable& set,
                                    const std::vector<model::Joint>& joints) {
  constexpr double kAngleStep_rad = 1e-3 * kRadPerDeg, kLengthStep_m = 1e-6;
  std::vector<std::string> digests;
  for (const MeasuredRow& row : set.rows) {
    if (!row.measured_W && !row.range_m && !row.gauge_m) continue;
    std::string text = row.artefact;
    for (Eigen::Index i = 0; i < row.q.size(); ++i) {
      const bool revolute = IsRevolute(joints, i);
      text += StepText(row.q[i], revolute ? kAngleStep_rad : kLengthStep_m,
                       revolute ? kTurn : std::optional<double>());
    }
    if (row.measured_W) {
      for (const double coordinate : *row.measured_W) text += StepText(coordinate, kLengthStep_m);
    }
    for (const auto& one : {row.range_m, row.gauge_m}) {
      text += one ? StepText(*one, kLengthStep_m) : ";";
    }
    digests.push_back(text::Sha256Hex(text).substr(0, 16));
  }
  std::ranges::sort(digests);
  digests.erase(std::unique(digests.begin(), digests.end()), digests.end());
  return digests;
}

std::vector<std::string> RowSketch(const MeasuredTable& set,
                                   const std::vector<model::Joint>& joints) {
  std::vector<std::string> digests = RowDigests(set, joints);
  if (digests.size() > kSketchRows) digests.resize(kSketchRows);
  return digests;
}

bool IsSketchOf(const std::vector<std::string>& sketch, const std::vector<std::string>& digests) {
  const auto common = std::ranges::count_if(sketch, [&](const std::string& digest) {
    return std::ranges::binary_search(digests, digest);
  });
  return IsRepeated(static_cast<std::size_t>(common), sketch.size(), digests.size());
}

}  // namespace plumbline::measure
