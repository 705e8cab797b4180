#include "app/diagnosis/dataset.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>

#include "app/diagnosis/clusters.h"
#include "app/diagnosis/impossible_values.h"
#include "app/diagnosis/joint_step.h"
#include "app/diagnosis/unit_changes.h"
#include "app/table/conditions.h"
#include "firmware-like/deflection/uncertainty.h"
#include "firmware-like/geometry/angle.h"
#include "firmware-like/statistics/median.h"

namespace plumbline::diagnosis {
namespace {

constexpr int kFewestRows = 4;
constexpr double kStandstill = 1e-4;      // a joint that moved less than this never moved
constexpr int kFewestRepeatFreedom = 12;  // of a sigma from repeats

/// Rows that repeat another to the last digit in every column, the clock among them, were copied,
/// not measured again. Without a clock they may be a coarse reading twice: they stay, and a note
/// tells of them.
void DropCopies(Dataset& data) {
  std::set<std::pair<std::string, std::vector<double>>> seen;
  const bool timed = data.table.recorded.time;
  int copies = 0, first = 0;
  std::erase_if(data.table.rows, [&](const table::MeasuredRow& row) {
    std::vector<double> numbers = {row.t_s,      row.payload_kg, row.temp_C,   row.range_m,
                                   row.p_WT.x(), row.p_WT.y(),   row.p_WT.z(), row.q_WT.w(),
                                   row.q_WT.x(), row.q_WT.y(),   row.q_WT.z(), row.q_step_rad};
    for (const model::JointVector* of_joints : {&row.q, &row.qd, &row.qdd, &row.tau}) {
      numbers.insert(numbers.end(), of_joints->begin(), of_joints->end());
    }
    numbers.insert(numbers.end(), row.further.begin(), row.further.end());
    if (seen.emplace(row.session, std::move(numbers)).second) return false;
    if (copies++ == 0) first = row.line;
    return timed;
  });
  if (copies == 0) return;
  data.notes.push_back(
      timed ? fmt::format(
                  "{} rows repeat an earlier one to the last digit and count once (first: line {})",
                  copies, first)
            : fmt::format("{} rows repeat an earlier one to the last digit (first: line {}); "
                          "without t_s they may have been measured again and count",
                          copies, first));
}

/// Rows without what the cell's kind of measurement needs only keep their place in the order of
/// moves.
void SetUnmeasuredAside(Dataset& data) {
  const bool range = data.ranges();
  table::MeasuredTable& table = data.table;
  const auto measured = [range](const table::MeasuredRow& row) {
    return range ? row.has_range : row.has_point;
  };
  const auto first = std::stable_partition(table.rows.begin(), table.rows.end(), measured);
  table.unmeasured.insert(table.unmeasured.end(), first, table.rows.end());
  table.rows.erase(first, table.rows.end());
  std::stable_sort(
      table.unmeasured.begin(), table.unmeasured.end(),
      [](const table::MeasuredRow& a, const table::MeasuredRow& b) { return a.line < b.line; });
  if (table.unmeasured.empty()) return;
  data.notes.push_back(fmt::format(
      "{} rows have joints and no measurement that can be used (first: line {}): they keep their "
      "place in the order of moves",
      table.unmeasured.size(), table.unmeasured.front().line));
}

void FindSessions(Dataset& data) {
  std::map<std::string, SessionIndex> known;
  for (const table::MeasuredRow& row : data.table.rows) {
    const auto [entry, fresh] = known.emplace(row.session, SessionIndex(data.sessions_count()));
    if (fresh) data.sessions.push_back(row.session);
    data.session_of.push_back(entry->second);
  }
}

void AddSignal(Dataset& data, std::string column, PerRow<double> values, bool of_joint) {
  RecordedSignal signal{std::move(column), std::move(values), of_joint};
  signal.low = *std::min_element(signal.values.begin(), signal.values.end());
  signal.high = *std::max_element(signal.values.begin(), signal.values.end());
  const double span = signal.high - signal.low;
  if (!(span > 1e-9 * (1 + std::abs(signal.high)))) return;
  std::set<long> distinct;
  for (const double value : signal.values) {
    if (distinct.size() < 50) distinct.insert(std::lround(1e4 * (value - signal.low) / span));
  }
  signal.distinct = static_cast<int>(distinct.size());
  data.signals.push_back(std::move(signal));
}

void FindSignals(Dataset& data) {
  const auto add = [&data](const std::string& column, bool of_joint = false) {
    PerRow<double> values;
    for (const effects::Conditions& moment : data.conditions) {
      const std::optional<double> value = moment.Signal(column);
      if (!value) return;
      values.push_back(*value);
    }
    AddSignal(data, column, std::move(values), of_joint);
  };
  add("t_s");
  if (!data.table.recorded.time) add("row");
  add("temp_C");
  if (data.table.recorded.payload) add("payload_kg");
  for (const std::string& column : data.table.further) add(column);
  for (int i = 0; i < data.cell.robot.size(); ++i) {
    const bool slides =
        data.cell.robot.joints[static_cast<std::size_t>(i)].type == model::JointType::kPrismatic;
    const char* unit = slides ? "mm" : "deg";
    add(fmt::format("q{}_{}", i + 1, unit), true);
    add(fmt::format("qd{}_{}_s", i + 1, unit), true);
    add(fmt::format("qdd{}_{}_s2", i + 1, unit), true);
    add(fmt::format("tau{}_{}", i + 1, slides ? "N" : "Nm"), true);
  }
}

void SayWhatIsMissing(Dataset& data) {
  const table::RecordedColumns& recorded = data.table.recorded;
  const auto missing = [&data](bool there, const char* what) {
    if (!there) data.not_recorded.emplace_back(what);
  };
  missing(recorded.time, "t_s: drift and warm-up with time cannot be told");
  missing(recorded.temperature, "temp_C: thermal growth cannot be told");
  missing(recorded.payload,
          "payload_kg: what follows the load is seen through the arm's own weight only");
  missing(recorded.qd, "qd1_deg_s..: latency and viscous lag cannot be told");
  missing(recorded.order,
          "the robot's moves between the probes: backlash by move and approach lag cannot be told");
  missing(recorded.qdd, "qdd1_deg_s2..: inertia cannot be told");
  if (recorded.time) {
    double first_s = 1e300, last_s = -1e300;
    for (const table::MeasuredRow& row : data.table.rows) {
      first_s = std::min(first_s, row.t_s);
      last_s = std::max(last_s, row.t_s);
    }
    // A warm-up goes as exp(-t / time constant) from t_s = 0 on. Counted from elsewhere it would
    // need a base that stands elsewhere and sizes e^(first / time constant) times as large.
    if (std::abs(first_s) > last_s - first_s) {
      data.not_recorded.push_back(
          fmt::format("t_s starts at {:.4g} s and lasts {:.4g} s: a warm-up counts from t_s = 0, "
                      "one that began "
                      "with these rows cannot be told; count t_s from its start",
                      first_s, last_s - first_s));
    }
  }
  if (recorded.payload && !data.cell.payload_cog_F) {
    data.notes.emplace_back(
        "payload_kg is recorded, but the cell has no [payload] cog_mm: the column is used as a "
        "signal only, the payload's weight is not computed");
  }
  if (!data.torques_known) {
    data.notes.emplace_back(
        "a link has no link_mass_kg, so that joint torques are unknown: compliance is sought as "
        "gravity_sag, by the products of compliance and weight that the poses identify; other "
        "effects of load in the joints cannot be told");
  }
  if (!data.table.unreadable_lines.empty()) {
    data.notes.push_back(fmt::format("{} rows could not be read and took no part (first: line {})",
                                     data.table.unreadable_lines.size(),
                                     data.table.unreadable_lines.front()));
  }
  if (data.cell.measurement.kind == model::MeasurementKind::kPose) {
    data.notes.emplace_back("of the measured poses the positions are used, not the orientations");
  }
}

/// One axis's standard deviation within clusters, about each cluster's mean, by the median so that
/// outliers do not raise it.
void NoiseFromRepeats(Dataset& data) {
  std::map<ClusterIndex, std::vector<RowIndex>> members;
  for (const RowIndex row : data.row_indices()) members[data.cluster_of[row]].push_back(row);
  std::vector<double> squares;
  for (const auto& [cluster, rows] : members) {
    for (std::size_t j = 1; j < rows.size(); ++j) {
      const table::MeasuredRow& a = data.measured(rows[j - 1]);
      const table::MeasuredRow& b = data.measured(rows[j]);
      const double square =
          data.ranges() ? std::pow(a.range_m - b.range_m, 2) : (a.p_WT - b.p_WT).squaredNorm();
      squares.push_back(square / 2);
    }
  }
  data.repeat_freedom = static_cast<int>(squares.size()) * (data.ranges() ? 1 : 3);
  if (data.repeat_freedom < kFewestRepeatFreedom) return;
  std::sort(squares.begin(), squares.end());
  // Median of chi^2_3 is 2.366, of chi^2_1 0.4549.
  const double middle = squares[squares.size() / 2];
  data.repeat_sigma_m = std::sqrt(middle / (data.ranges() ? 0.4549 : 2.366));
}

/// What joints read in steps leave open of the tip that is predicted from them.
struct ReadingError {
  double radius_m = 0;  ///< 95 %, middle row
  double sigma_m = 0;   ///< one axis, as it adds to the instrument's
};

/// The tip that is predicted from joints read in steps is off by an error of its own, beside the
/// instrument's. Uniform within a step, C_k = step^2 / 12 J J^T at row k. It is the same error each
/// time that the robot is at one pose, so that n repeats do not average it away: as noise of single
/// rows that average like sigma^2 / n, it counts n-fold. One number for all rows, the mean over
/// them of the largest variance along any direction.
/// @param steps_rad  of each row
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

/// The share of the instrument's noise from which on a reading error is worth a word.
constexpr double kNotableShare = 0.1;

/// Steps that the rows declare (q_step_deg) count as noise.
void AddReadingError(Dataset& data) {
  PerRow<double> steps_rad;
  for (const table::MeasuredRow& row : data.table.rows) steps_rad.push_back(row.q_step_rad);
  data.q_step_rad = *std::max_element(steps_rad.begin(), steps_rad.end());
  const ReadingError error = ReadingErrorOf(data, steps_rad);
  data.reading_radius_m = error.radius_m;
  data.reading_sigma_m = error.sigma_m;
  // Where sigma is taken from the residual, that holds the reading error already.
  if (data.sigma_m <= 0 || data.reading_sigma_m < kNotableShare * data.sigma_m) return;
  data.notes.push_back(fmt::format(
      "the joints were read in steps of {:.3g} mrad, which costs {:.2g} mm at the tool (95 %): it "
      "counts as noise, and hides what is smaller; read finer registers to see it",
      1e3 * data.q_step_rad, 1e3 * data.reading_radius_m));
  data.sigma_m = std::hypot(data.sigma_m, data.reading_sigma_m);
  data.sigma_origin += " and the steps of the joint readings";
}

/// Steps that the readings show and nobody declared are told where they matter at the tip. They do
/// not count as noise by themselves: poses may have been commanded at such values.
void TellUndeclaredStep(Dataset& data) {
  constexpr double kNotable_m = 1e-5;  // where the instrument's noise is not known
  constexpr double kLeastToldPower = -12;
  const auto step = JointStepOf(data.table, data.cell.robot.joints);
  if (!step) return;
  const PerRow<double> steps_rad(data.table.rows.size(), step->step_rad);
  const ReadingError error = ReadingErrorOf(data, steps_rad);
  const double notable_m = data.sigma_m > 0 ? kNotableShare * data.sigma_m : kNotable_m;
  if (error.sigma_m < notable_m) return;
  const double step_deg = step->step_rad / kRadPerDeg;
  const std::string steps = fmt::format("{:.3g} deg ({:.3g} mrad)", step_deg, 1e3 * step->step_rad);
  const std::string cost = fmt::format("{:.2g} mm at the tool (95 %)", 1e3 * error.radius_m);
  data.notes.push_back(
      step->as_written
          ? fmt::format(
                "the joints are written to {} decimals, in steps of {}, which costs {} and "
                "does not count as noise: write more decimals; where the controller gives no "
                "more, add the column q_step_deg with {:.6g} in every row",
                *data.table.q_decimals, steps, cost, step_deg)
          : fmt::format(
                "all {} different joint readings are multiples of {}, though {} decimals are "
                "written and no q_step_deg is declared (by chance with a probability below "
                "1e{:.0f}): if the controller gives its joints in such steps, that costs {} and "
                "does not count as noise yet; read finer registers, or add the column q_step_deg "
                "with {:.6g} in every row; poses that were commanded at such values need neither",
                step->readings, steps, *data.table.q_decimals,
                std::max(kLeastToldPower, std::ceil(step->log10_chance)), cost, step_deg));
}

}  // namespace

RowLayout Dataset::layout() const {
  RowLayout layout;
  for (const RowNumbers& of_row : numbers) layout.Add(of_row.count);
  return layout;
}

double Dataset::lengths_per_row() const {
  int measuring = 0, lengths = 0;
  for (const RowNumbers& of_row : numbers) {
    measuring += of_row.count > 0 ? 1 : 0;
    lengths += of_row.lengths();
  }
  return measuring > 0 ? static_cast<double>(lengths) / measuring : 0;
}

FitRows EveryRow(const Dataset& data) {
  return EvenlySpacedRows(data, data.rows());
}

FitRows EvenlySpacedRows(const Dataset& data, int most) {
  FitRows rows;
  const int count = data.rows(), taken = std::min(count, most);
  rows.reserve(static_cast<std::size_t>(taken));
  for (int k = 0; k < taken; ++k) rows.emplace_back(std::int64_t{k} * count / taken);
  return rows;
}

Dataset SelectRows(const Dataset& data, const FitRows& rows) {
  Dataset thin = data;
  // New containers instead of cleared ones, which would keep the room of all rows.
  thin.table.rows = std::vector<table::MeasuredRow>();
  thin.conditions = PerRow<effects::Conditions>();
  thin.payloads = PerRow<loads::Payload>();
  thin.numbers = PerRow<RowNumbers>();
  thin.session_of = PerRow<SessionIndex>();
  thin.cluster_of = PerRow<ClusterIndex>();
  for (RecordedSignal& signal : thin.signals) signal.values = PerRow<double>();
  std::map<ClusterIndex, ClusterIndex> renumbered;
  for (const RowIndex row : rows) {
    thin.table.rows.push_back(data.measured(row));
    thin.conditions.push_back(data.conditions[row]);
    thin.payloads.push_back(data.payloads[row]);
    thin.numbers.push_back(data.numbers[row]);
    thin.session_of.push_back(data.session_of[row]);
    thin.cluster_of.push_back(
        renumbered.emplace(data.cluster_of[row], ClusterIndex(renumbered.size())).first->second);
    for (const SignalIndex signal : data.signals.indices()) {
      thin.signals[signal].values.push_back(data.signals[signal].values[row]);
    }
  }
  thin.clusters = static_cast<int>(renumbered.size());
  return thin;
}

namespace {

int NumbersOfARow(const Dataset& data) {
  return data.ranges() ? 1 : 3;
}

/// Why the table holds nothing to diagnose.
std::optional<Error> WithoutMeasuredValues(const Dataset& data) {
  const bool range = data.ranges();
  if (range ? data.table.recorded.range : data.table.recorded.position) return {};
  return Error{
      fmt::format("has no {} column{}: nothing was measured; the cell says "
                  "[measurement] kind, check it and the header",
                  range ? "range_mm" : "x_mm, y_mm, z_mm", range ? "" : "s")};
}

std::optional<Error> TooFewRows(const Dataset& data) {
  const int free_numbers =
      data.sessions_count() * ((data.frames_free() ? 6 : 0) + (data.tip_free() ? 3 : 0));
  const int of_row = NumbersOfARow(data);
  const int needed = std::max(kFewestRows, (free_numbers + 3 + of_row - 1) / of_row);
  if (data.rows() >= needed) return {};
  return Error{
      fmt::format("has {} usable rows; at least {} are needed{}: measure more poses, "
                  "spread over the cell (30 or more tell effects apart)",
                  data.rows(), needed, free_numbers > 0 ? " to find the unknown frames" : "")};
}

/// Conditions, loads and clusters of the rows.
void DescribeRows(Dataset& data) {
  const model::CellModel& cell = data.cell;
  data.numbers.assign(data.table.rows.size(), {NumbersOfARow(data), {}});
  data.conditions = PerRow<effects::Conditions>(ConditionsOf(cell, data.table));
  for (const table::MeasuredRow& row : data.table.rows) {
    const bool loaded = data.table.recorded.payload && cell.payload_cog_F;
    data.payloads.push_back(loaded ? loads::Payload{row.payload_kg, *cell.payload_cog_F}
                                   : loads::Payload{});
  }
  data.weight_known = loads::GravityLoads(cell).known(0);
  data.torques_known = data.weight_known || data.table.recorded.tau;
  const Clusters clusters = ClustersOf(data.table.rows, data.session_of);
  data.cluster_of = clusters.of_row;
  data.clusters = clusters.count;
}

void FindStillJoints(Dataset& data) {
  for (int i = 0; i < data.cell.robot.size(); ++i) {
    const auto moved = [&](const table::MeasuredRow& row) {
      return std::abs(row.q[i] - data.table.rows.front().q[i]) > kStandstill;
    };
    if (std::any_of(data.table.rows.begin(), data.table.rows.end(), moved)) continue;
    data.still_joints.push_back(i);
    data.notes.push_back(
        fmt::format("joint q{} never moved: what depends on it cannot be told", i + 1));
  }
}

/// The declared sigma, else that of repeats, else left to the residual.
void SettleNoise(Dataset& data) {
  NoiseFromRepeats(data);
  if (data.cell.measurement.sigma_m) {
    data.sigma_m = *data.cell.measurement.sigma_m;
    data.sigma_origin = "declared";
    if (data.repeat_sigma_m > 2 * data.sigma_m) {
      data.notes.push_back(
          fmt::format("repeated points scatter by {:.3g} mm, more than the declared sigma_mm = "
                      "{:.3g}: check the "
                      "instrument, or what moved between the repeats",
                      1e3 * data.repeat_sigma_m, 1e3 * data.sigma_m));
    }
  } else if (data.repeat_sigma_m > 0) {
    data.sigma_m = data.repeat_sigma_m;
    data.sigma_origin = "repeats";
  } else {
    data.sigma_origin = "residual";
  }
}

}  // namespace

Result<Dataset> DatasetFrom(const model::CellModel& cell, table::MeasuredTable measured) {
  Dataset data;
  data.cell = cell;
  data.table = std::move(measured);
  if (auto error = WithoutMeasuredValues(data)) return *error;
  SetUnmeasuredAside(data);
  DropCopies(data);
  if (const auto impossible = ImpossibleValues(data.table, cell.robot.joints)) {
    return Error{*impossible};
  }
  if (const auto grams = PayloadsInGrams(data.table)) return Error{*grams};
  GiveUpRestartedClock(data.table);
  data.notes.insert(data.notes.end(), data.table.notes.begin(), data.table.notes.end());
  FindSessions(data);
  if (auto error = TooFewRows(data)) return *error;
  DescribeRows(data);
  FindSignals(data);
  FindStillJoints(data);
  SettleNoise(data);
  if (data.table.recorded.q_step) {
    AddReadingError(data);
  } else {
    TellUndeclaredStep(data);
  }
  SayWhatIsMissing(data);
  return data;
}

}  // namespace plumbline::diagnosis
