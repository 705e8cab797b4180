#include "app/measure/diagnosis/preparation/dataset_noise.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "firmware-like/deflection/uncertainty.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

constexpr double kSamePose = 2e-4;    // [rad] or [m], between neighbours
constexpr double kWidestPose = 2e-3;  // a wider chain is a path, not a pose
constexpr double kSamePayload_kg = 0.01;

/// A row as a point: joints and payload in units of their tolerances, tool and item so that
/// different ones are far apart.
std::vector<double> Place(const MeasuredRow& row) {
  std::vector<double> place(row.q.begin(), row.q.end());
  for (double& q : place) q /= kSamePose;
  place.push_back(row.payload_kg.value_or(0) / kSamePayload_kg);
  constexpr double kFarApart = 10;
  place.push_back(kFarApart * row.tool_number.value_or(0));
  place.push_back(kFarApart * row.payload_item.value_or(0));
  return place;
}

using RowPlaces = PerRow<std::vector<double>>;

/// Divides rows recursively at gaps larger than one in any coordinate, across which no chain can
/// exist. Each part is appended to `parts`.
void CutAtGaps(const RowPlaces& places, std::vector<RowIndex> rows,
               std::vector<std::vector<RowIndex>>& parts) {
  for (std::size_t axis = 0; axis < places.front().size(); ++axis) {
    const auto at = [&](RowIndex row) { return places[row][axis]; };
    std::ranges::sort(rows, [&](RowIndex a, RowIndex b) { return at(a) < at(b); });
    const auto gap = [&](RowIndex a, RowIndex b) { return at(b) - at(a) > 1; };
    auto cut = std::adjacent_find(rows.begin(), rows.end(), gap);
    if (cut == rows.end()) continue;
    auto from = rows.begin();
    while (cut != rows.end()) {
      CutAtGaps(places, {from, cut + 1}, parts);
      from = cut + 1;
      cut = std::adjacent_find(from, rows.end(), gap);
    }
    CutAtGaps(places, {from, rows.end()}, parts);
    return;
  }
  parts.push_back(std::move(rows));
}

/// Single linkage: rows that differ by at most one in every coordinate belong together.
/// @return  a label for each of `rows`, equal for rows that belong together
std::vector<int> Linked(const RowPlaces& places, const std::vector<RowIndex>& rows) {
  const auto count = static_cast<int>(rows.size());
  std::vector<int> leader(rows.size());
  std::iota(leader.begin(), leader.end(), 0);
  const auto leader_of = [&](int k) {
    while (leader[k] != k) {
      const int up = leader[k];
      k = leader[k] = leader[up];
    }
    return k;
  };
  const auto place = [&](int k) -> const std::vector<double>& { return places[rows[k]]; };
  // Sweep along the coordinate with the widest spread.
  std::size_t widest = 0;
  double width = -1;
  for (std::size_t axis = 0; axis < places.front().size(); ++axis) {
    double low = 1e300, high = -1e300;
    for (int k = 0; k < count; ++k) {
      low = std::min(low, place(k)[axis]);
      high = std::max(high, place(k)[axis]);
    }
    if (high - low > width) {
      width = high - low;
      widest = axis;
    }
  }
  std::vector<int> order(leader);
  std::ranges::sort(order, [&](int a, int b) { return place(a)[widest] < place(b)[widest]; });
  for (int i = 0; i < count; ++i) {
    const int a = order[i];
    for (int j = i + 1; j < count; ++j) {
      const int b = order[j];
      if (place(b)[widest] - place(a)[widest] > 1) break;
      const bool near = std::equal(place(a).begin(), place(a).end(), place(b).begin(),
                                   [](double x, double y) { return std::abs(x - y) <= 1; });
      if (near) leader[leader_of(b)] = leader_of(a);
    }
  }
  for (int k = 0; k < count; ++k) leader[k] = leader_of(k);
  return leader;
}

}  // namespace

Clusters ClustersOf(const std::vector<MeasuredRow>& rows, const PerRow<SessionIndex>& session_of) {
  RowPlaces places;
  for (const MeasuredRow& row : rows) places.push_back(Place(row));
  std::map<SessionIndex, std::vector<RowIndex>> of_session;
  for (const RowIndex row : places.indices()) of_session[session_of[row]].push_back(row);
  std::vector<std::vector<RowIndex>> parts;
  for (auto& [session, own] : of_session) CutAtGaps(places, std::move(own), parts);
  // (part, chain, grid cell of a path) of each row
  PerRow<std::tuple<std::size_t, int, std::vector<long>>> names(places.size());
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const std::vector<int> chains = Linked(places, parts[part]);
    std::map<int, std::pair<std::vector<double>, std::vector<double>>> extent;
    for (std::size_t k = 0; k < chains.size(); ++k) {
      const std::vector<double>& place = places[parts[part][k]];
      auto& [low, high] = extent.try_emplace(chains[k], place, place).first->second;
      for (std::size_t axis = 0; axis < place.size(); ++axis) {
        low[axis] = std::min(low[axis], place[axis]);
        high[axis] = std::max(high[axis], place[axis]);
      }
    }
    for (std::size_t k = 0; k < chains.size(); ++k) {
      const RowIndex row = parts[part][k];
      const auto& [low, high] = extent[chains[k]];
      double wide = 0;
      for (std::size_t axis = 0; axis < low.size(); ++axis) {
        wide = std::max(wide, high[axis] - low[axis]);
      }
      auto& [of_part, chain, cell] = names[row];
      of_part = part;
      chain = chains[k];
      if (wide <= kWidestPose / kSamePose) continue;
      for (const double x : places[row]) cell.push_back(std::lround(x));
    }
  }
  std::map<std::tuple<std::size_t, int, std::vector<long>>, ClusterIndex> known;
  Clusters clusters;
  for (const auto& name : names) {
    const auto [entry, inserted] = known.emplace(name, ClusterIndex(clusters.count));
    if (inserted) ++clusters.count;
    clusters.of_row.push_back(entry->second);
  }
  return clusters;
}

namespace {

constexpr double kCoarsest_deg = 0.2;
constexpr double kLargestLog10Chance = -6;
constexpr double kRounding_deg = 1e-9;  // of the conversion deg -> rad -> deg, over many turns
constexpr double kTurn_deg = 360;

/// Usual steps, coarsest first.
std::vector<double> UsualSteps_deg() {
  std::vector<double> steps;
  for (int power = 1; power >= -5; --power) {
    for (const double digit : {5.0, 2.0, 1.0}) {
      const double step = digit * std::pow(10.0, power);
      steps.push_back(step);                      // deg
      steps.push_back(1e-3 * step / kRadPerDeg);  // mrad
    }
  }
  for (int bits = 10; bits <= 20; ++bits) steps.push_back(std::ldexp(kTurn_deg, -bits));
  std::ranges::sort(steps, std::greater<>());
  return steps;
}

/// Distinct readings of every revolute joint, without zeros (multiples of any step).
std::vector<double> DistinctReadings_deg(const MeasuredTable& table,
                                         const std::vector<model::Joint>& joints) {
  std::vector<double> readings;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (joints[i].type == model::JointType::kPrismatic) continue;
    std::vector<double> values;
    for (const MeasuredRow& row : table.rows) {
      const double value = row.q[static_cast<Eigen::Index>(i)] / kRadPerDeg;
      if (std::abs(value) > kRounding_deg) values.push_back(value);
    }
    std::ranges::sort(values);
    const auto same = [](double a, double b) { return std::abs(a - b) <= kRounding_deg; };
    values.erase(std::unique(values.begin(), values.end(), same), values.end());
    readings.insert(readings.end(), values.begin(), values.end());
  }
  return readings;
}

bool AllMultiples(const std::vector<double>& readings, double step, double tolerance) {
  return std::ranges::all_of(readings, [&](double value) {
    return std::abs(value - step * std::round(value / step)) <= tolerance;
  });
}

}  // namespace

std::optional<JointStep> JointStepOf(const MeasuredTable& table,
                                     const std::vector<model::Joint>& joints) {
  if (!table.q_decimals) return std::nullopt;
  const std::vector<double> readings = DistinctReadings_deg(table, joints);
  if (readings.empty()) return std::nullopt;
  const int count = static_cast<int>(readings.size());
  const double written_deg = std::pow(10.0, -*table.q_decimals);
  const std::vector<double> steps = UsualSteps_deg();
  for (const double step_deg : steps) {
    if (step_deg < 1.5 * written_deg) break;
    if (!AllMultiples(readings, step_deg, 0.5 * written_deg + kRounding_deg)) continue;
    const double log10_chance =
        std::log10(static_cast<double>(steps.size())) + count * std::log10(written_deg / step_deg);
    if (log10_chance > kLargestLog10Chance) continue;
    if (step_deg > kCoarsest_deg) return std::nullopt;
    return JointStep{step_deg * kRadPerDeg, false, log10_chance, count};
  }
  if (written_deg > kCoarsest_deg) return std::nullopt;
  return JointStep{written_deg * kRadPerDeg, true, 0, count};
}

namespace {

constexpr int kMinRepeatFreedom = 12;  // minimum degrees of freedom of a sigma from replicates

/// Squared difference of two measurements of one kind [m^2]; nullopt if they are not comparable.
/// Touches cannot be compared: only the joint readings are recorded.
std::optional<double> SquaredDifference(const Dataset& data, RowIndex a, RowIndex b) {
  const Observation &of_a = data.observations[a], &of_b = data.observations[b];
  const MeasuredRow &row_a = data.measured(a), &row_b = data.measured(b);
  if (of_a.kind != of_b.kind || of_a.artefact != of_b.artefact) return std::nullopt;
  switch (of_a.kind) {
    case ObservationKind::kPosition:
    case ObservationKind::kPose:
      return (*row_a.measured_W - *row_b.measured_W).squaredNorm();
    case ObservationKind::kRange:
    case ObservationKind::kArtefactRange:
      return std::pow(*row_a.range_m - *row_b.range_m, 2);
    case ObservationKind::kGauge:
      return std::pow(*row_a.gauge_m - *row_b.gauge_m, 2);
    default:
      return std::nullopt;
  }
}

/// Median; of an even number of values, the lower of the two in the middle, so that it is the noise
/// of some row even if half of the rows are much noisier.
double LowerMedian(const PerRow<double>& values) {
  std::vector<double> sorted(values.begin(), values.end());
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>((sorted.size() - 1) / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  return *middle;
}

/// Standard deviation of one axis from successive differences within clusters; by the median, so
/// that outliers do not increase it. If kinds of 1 and of 3 residuals are mixed, only those with
/// more degrees of freedom count. Rows that state different noise are scaled to its median.
/// @param stated_m  stated noise of each row; empty if none is stated
void NoiseFromRepeats(Dataset& data, const PerRow<double>& stated_m) {
  const double median_m = stated_m.empty() ? 0 : LowerMedian(stated_m);
  const auto variance = [&](RowIndex row) {
    return stated_m.empty() ? 1 : std::pow(stated_m[row] / median_m, 2);
  };
  // Two cameras differ by more than their noise.
  std::map<std::pair<ClusterIndex, std::string>, std::vector<RowIndex>> members;
  for (const RowIndex row : data.row_indices()) {
    members[{data.cluster_of[row], data.measured(row).camera}].push_back(row);
  }
  std::vector<double> of_lengths, of_points;
  for (const auto& [cluster, rows] : members) {
    for (std::size_t j = 1; j < rows.size(); ++j) {
      const auto square = SquaredDifference(data, rows[j - 1], rows[j]);
      if (!square) continue;
      const bool length = ResidualsOf(data.observations[rows[j]].kind) == 1;
      const double of_difference = variance(rows[j - 1]) + variance(rows[j]);
      (length ? of_lengths : of_points).push_back(*square / of_difference);
    }
  }
  const bool lengths = of_lengths.size() > 3 * of_points.size();
  std::vector<double>& squares = lengths ? of_lengths : of_points;
  data.repeat_freedom = static_cast<int>(squares.size()) * (lengths ? 1 : 3);
  if (data.repeat_freedom < kMinRepeatFreedom) return;
  std::ranges::sort(squares);
  // Median of chi^2_3 is 2.366, of chi^2_1 0.4549.
  const double median = squares[squares.size() / 2];
  data.repeat_sigma_m = std::sqrt(median / (lengths ? 0.4549 : 2.366));
}

/// Uncertainty of the predicted tip due to the resolution of the joint readings.
struct ReadingError {
  double radius_m = 0;  ///< 95 %, median row
  double sigma_m = 0;   ///< one axis, to be added to the instrument's noise
};

/// Error of the predicted tip due to the joint resolution, uniform within a step: C_k = step^2 / 12
/// J J^T at row k. The error is the same at every visit of a pose, so n replicates do not average
/// it. To have this effect as noise of single rows, whose mean has variance sigma^2 / n, its
/// variance is multiplied by n. One value is used for all rows: the mean of the largest variance
/// along any direction.
/// @param steps_rad  step of each row
ReadingError ReadingErrorOf(const Dataset& data, const PerRow<double>& steps_rad) {
  const deflection::LoadedArm arm(data.cell);
  Indexed<ClusterIndex, int> repeats(static_cast<std::size_t>(data.clusters), 0);
  for (const ClusterIndex cluster : data.cluster_of) ++repeats[cluster];
  double sum = 0;
  std::vector<double> radii;
  for (const RowIndex row : data.row_indices()) {
    deflection::LoadedState state;
    arm.AtActual(data.measured(row).q, data.payloads[row], data.conditions[row], state);
    const Mat3 covariance = deflection::ReadingCovariance(arm, state, steps_rad[row]);
    radii.push_back(deflection::RadiusHolding95Percent(covariance));
    const double largest = Eigen::SelfAdjointEigenSolver<Mat3>(covariance).eigenvalues()[2];
    sum += repeats[data.cluster_of[row]] * largest;
  }
  return {statistics::MedianOf(radii), std::sqrt(sum / data.rows())};
}

/// A reading error above this share of the instrument's noise is reported.
constexpr double kNotableShare = 0.1;

/// Adds the declared joint resolution (q_step_deg) to the noise.
void AddReadingError(Dataset& data) {
  PerRow<double> steps_rad;
  for (const MeasuredRow& row : data.table.rows) steps_rad.push_back(row.q_step_rad.value_or(0));
  data.q_step_rad = *std::ranges::max_element(steps_rad);
  const ReadingError error = ReadingErrorOf(data, steps_rad);
  data.reading_radius_m = error.radius_m;
  data.reading_sigma_m = error.sigma_m;
  // A sigma from the residual already includes the reading error.
  if (data.sigma_m <= 0 || data.reading_sigma_m < kNotableShare * data.sigma_m) return;
  data.notes.push_back(
      fmt::format("the joint readings have a resolution of {:.3g} mrad, which causes an error of "
                  "{:.2g} mm at the tool (95 %): it counts as noise and hides smaller effects; "
                  "read registers with a finer resolution to identify them",
                  1e3 * data.q_step_rad, 1e3 * data.reading_radius_m));
  data.sigma_m = std::hypot(data.sigma_m, data.reading_sigma_m);
  data.sigma_origin += " and the joint resolution";
}

/// Adds a note if the readings show an undeclared step that matters at the tip. Such a step does
/// not count as noise, since the poses may have been commanded at such values.
void NoteUndeclaredStep(Dataset& data) {
  constexpr double kNotable_m = 1e-5;  // if the instrument's noise is unknown
  constexpr double kMinReportedExponent = -12;
  const auto step = JointStepOf(data.table, data.cell.robot.joints);
  if (!step) return;
  const PerRow<double> steps_rad(data.table.rows.size(), step->step_rad);
  const ReadingError error = ReadingErrorOf(data, steps_rad);
  const double notable_m = data.sigma_m > 0 ? kNotableShare * data.sigma_m : kNotable_m;
  if (error.sigma_m < notable_m) return;
  const double step_deg = step->step_rad / kRadPerDeg;
  const std::string steps = fmt::format("{:.3g} deg ({:.3g} mrad)", step_deg, 1e3 * step->step_rad);
  const std::string error_text = fmt::format("{:.2g} mm at the tool (95 %)", 1e3 * error.radius_m);
  data.notes.push_back(
      step->as_written
          ? fmt::format(
                "the joint readings are written to {} decimals, in steps of {}, which causes an "
                "error of {} that does not count as noise: write more decimals; if the controller "
                "has no finer resolution, add the column q_step_deg with {:.6g} in every row",
                *data.table.q_decimals, steps, error_text, step_deg)
          : fmt::format("all {} different joint readings are multiples of {}, although {} decimals "
                        "are written and no q_step_deg is declared (probability of a coincidence "
                        "below 1e{:.0f}): if this is the resolution of the controller, it causes "
                        "an error of {} that does not yet count as noise; read registers with a "
                        "finer resolution, or add the column q_step_deg with {:.6g} in every row; "
                        "if the poses were commanded at such values, ignore this note",
                        step->readings, steps, *data.table.q_decimals,
                        std::max(kMinReportedExponent, std::ceil(step->log10_chance)), error_text,
                        step_deg));
}

/// Standard deviation of the instrument's noise that each row states, one axis: its own, otherwise
/// the declared one, otherwise the median of the rows' own; empty if neither is stated.
PerRow<double> StatedSigmas(const Dataset& data) {
  PerRow<double> own_m, stated_m;
  for (const MeasuredRow& row : data.table.rows) {
    if (row.sigma_m) own_m.push_back(*row.sigma_m);
  }
  const std::optional<double> declared_m = data.cell.measurement.sigma_m;
  if (own_m.empty() && !declared_m) return stated_m;
  const double other_m = declared_m ? *declared_m : LowerMedian(own_m);
  for (const MeasuredRow& row : data.table.rows) {
    stated_m.push_back(row.sigma_m.value_or(other_m));
  }
  return stated_m;
}

/// Adds a note if the column sigma_mm replaces a clearly different declared noise.
void NoteReplacedSigma(Dataset& data) {
  constexpr double kClearly = 1.5;
  const std::optional<double> declared_m = data.cell.measurement.sigma_m;
  if (!declared_m) return;
  const double ratio = *data.row_sigma_m / *declared_m;
  if (std::max(ratio, 1 / ratio) < kClearly) return;
  data.notes.push_back(
      fmt::format("the column sigma_mm, median {:.3g} mm, replaces the declared sigma_mm = {:.3g}",
                  1e3 * *data.row_sigma_m, 1e3 * *declared_m));
}

/// Sets the covariances of rows with their own standard deviation, and of orientations, relative to
/// the noise of the data set. The part of that noise that the instrument does not cause, the joint
/// resolution, is the same for every row.
/// @param stated_m         noise of the instrument in each row; empty if none is stated
/// @param of_instrument_m  the same for the data set
void SetCovariances(Dataset& data, const PerRow<double>& stated_m, double of_instrument_m) {
  constexpr double kSame = 1e-9;
  const double variance_m2 = data.sigma_m * data.sigma_m;
  const double added_m2 = variance_m2 - of_instrument_m * of_instrument_m;
  for (const RowIndex row : data.row_indices()) {
    RowNumbers& numbers = data.numbers[row];
    const double of_row_m = stated_m.empty() ? of_instrument_m : stated_m[row];
    const double relative = (of_row_m * of_row_m + added_m2) / variance_m2;
    if (std::abs(relative - 1) < kSame && numbers.count <= kMaxLengths) continue;
    numbers.covariance = relative * Eigen::MatrixXd::Identity(numbers.count, numbers.count);
    if (numbers.count <= kMaxLengths) continue;
    const double turn = data.cell.measurement.sigma_rad.value() / data.sigma_m;
    numbers.covariance.bottomRightCorner<3, 3>() = turn * turn * Mat3::Identity();
  }
}

}  // namespace

void SetNoise(Dataset& data) {
  const PerRow<double> stated_m = StatedSigmas(data);
  NoiseFromRepeats(data, stated_m);
  const std::vector<MeasuredRow>& rows = data.table.rows;
  const auto states = [](const MeasuredRow& row) { return row.sigma_m.has_value(); };
  if (std::ranges::any_of(rows, states)) {
    data.row_sigma_m = LowerMedian(stated_m);
    data.sigma_m = *data.row_sigma_m;
    data.sigma_origin = "median of the column sigma_mm";
    if (data.cell.measurement.sigma_m && !std::ranges::all_of(rows, states)) {
      data.sigma_origin += ", declared where it is empty";
    }
    NoteReplacedSigma(data);
  } else if (data.cell.measurement.sigma_m) {
    data.sigma_m = *data.cell.measurement.sigma_m;
    data.sigma_origin = "declared";
  } else if (data.repeat_sigma_m > 0) {
    data.sigma_m = data.repeat_sigma_m;
    data.sigma_origin = "repeats";
  } else {
    data.sigma_origin = "residual";
  }
  const double of_instrument_m = data.sigma_m;
  if (data.table.recorded.q_step) {
    AddReadingError(data);
  } else {
    NoteUndeclaredStep(data);
  }
  if (data.sigma_m > 0) SetCovariances(data, stated_m, of_instrument_m);
}

}  // namespace plumbline::measure
