#include "app/measure/diagnosis/verdict.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <vector>

#include "app/measure/diagnosis/diagnosis_text.h"
#include "app/measure/diagnosis/empirical_columns.h"
#include "app/measure/diagnosis/linear_problem.h"
#include "app/measure/diagnosis/load_direction.h"
#include "app/measure/diagnosis/misfit.h"
#include "app/measure/diagnosis/nuisances.h"
#include "app/measure/diagnosis/open_world.h"
#include "app/measure/diagnosis/periodic_search.h"
#include "app/measure/diagnosis/robust.h"
#include "app/measure/diagnosis/thresholds.h"

namespace plumbline::measure {
namespace {

constexpr double kMinFreedom = 12;

/// Rows of one cluster whose residuals can be compared: of one kind, artefact and camera, since
/// two cameras differ by more than their noise.
using ReplicatesKey = std::tuple<ClusterIndex, ObservationKind, int, std::string>;

ReplicatesKey KeyOf(const Dataset& data, RowIndex row) {
  const Observation& observation = data.observations[row];
  const int artefact = OnArtefact(observation.kind) ? observation.artefact.value() : -1;
  return {data.cluster_of[row], observation.kind, artefact, data.measured(row).camera};
}

/// True for a row that measures something at its joint readings. A touch measures the joints
/// themselves, so that two touches at equal readings are equal.
bool Compares(const Dataset& data, RowIndex row) {
  switch (data.observations[row].kind) {
    case ObservationKind::kPosition:
    case ObservationKind::kPose:
    case ObservationKind::kRange:
    case ObservationKind::kArtefactRange:
    case ObservationKind::kGauge:
      return true;
    default:
      return false;
  }
}

/// Lengths of a residual in units of the row's own noise, times the noise of the data set [m].
Vec3 ScaledLengths(const RowNumbers& numbers, const RowResidual& residual) {
  const double variance = numbers.LengthVariance() / numbers.lengths();
  return LengthsOf(residual) / std::sqrt(variance);
}

/// Sums over the rows of a group, or over groups.
struct Squares {
  double sum = 0, freedom = 0;
};

/// Excess kurtosis of all components about zero, at least 0.
double ExcessKurtosis(const std::vector<Vec3>& lengths, double components) {
  double second = 0, fourth = 0;
  for (const Vec3& one : lengths) {
    second += one.squaredNorm();
    fourth += one.array().pow(4).sum();
  }
  return second > 0 ? std::max(0.0, fourth * components / (second * second) - 3) : 0;
}

}  // namespace

std::optional<LackOfFit> LackOfFitOf(const Dataset& data, const PerRow<RowResidual>& residuals,
                                     const PerRow<double>& weights, double row_correlation,
                                     double parameters) {
  std::map<ReplicatesKey, std::vector<Vec3>> groups;
  std::map<ReplicatesKey, int> components;  // of one row
  std::vector<Vec3> all;
  double count = 0;  // of components
  for (const RowIndex row : data.row_indices()) {
    const int lengths = data.numbers[row].lengths();
    if (lengths == 0 || weights[row] < kOutlierWeight || !Compares(data, row)) continue;
    const ReplicatesKey key = KeyOf(data, row);
    groups[key].push_back(ScaledLengths(data.numbers[row], residuals[row]));
    components[key] = lengths;
    all.push_back(groups[key].back());
    count += lengths;
  }
  Squares within, between;
  for (const auto& [key, rows] : groups) {
    const auto n = static_cast<double>(rows.size());
    Vec3 mean = Vec3::Zero();
    for (const Vec3& row : rows) mean += row / n;
    for (const Vec3& row : rows) within.sum += (row - mean).squaredNorm();
    within.freedom += (n - 1) * components[key];
    between.sum += n * mean.squaredNorm();
    between.freedom += components[key];
  }
  between.freedom -= parameters;
  if (std::min(within.freedom, between.freedom) < kMinFreedom) return std::nullopt;

  LackOfFit found;
  found.replicates_m = std::sqrt(within.sum / within.freedom);
  found.replicates_freedom = within.freedom;
  found.between_poses_m = std::sqrt(between.sum / between.freedom);
  found.between_poses_freedom = between.freedom;
  // Successive replicates share a part of correlated noise.
  const double independent_m = found.replicates_m / std::sqrt(1 - row_correlation);
  found.noise_m = std::max(std::hypot(independent_m, data.reading_sigma_m), data.sigma_m);
  const double tails = 1 + ExcessKurtosis(all, count) / 2;
  const double quantile =
      FisherQuantile(kLackOfFitSignificance, between.freedom / tails, within.freedom / tails);
  const double notable = 1 + kNotableLackOfFit * kNotableLackOfFit * count / between.freedom;
  found.limit_m = found.noise_m * std::sqrt(std::max(quantile, notable));
  return found;
}

namespace {

// Permutation tests of the recorded signals: which ones a residual follows.

/// Tests for each recorded signal whether a residual follows it through any carrier: the explained
/// share of chi2, and its p-value by a permutation test that flips the signs of whole clusters and
/// takes the maximum over all signals (family-wise).
/// @param residual  whitened and projected
/// @param flips     number of permutations
std::vector<SignalTrace> TestSignals(const LinearProblem& problem, const Eigen::VectorXd& residual,
                                     int flips) {
  const Dataset& data = problem.data();
  const auto carriers = Carriers(data);
  // One orthonormal basis per signal and carrier, spanning its linear and quadratic columns.
  const auto indices = problem.rows().indices();
  const std::vector<FitRowIndex> all(indices.begin(), indices.end());
  Indexed<SignalIndex, std::vector<Eigen::MatrixXd>> bases(data.signals.size());
  for (const SignalIndex s : data.signals.indices()) {
    const std::vector<int> degrees = Degrees(data.signals[s], 3);
    if (degrees.empty()) continue;
    const int degree = degrees[std::min<std::size_t>(degrees.size() - 1, 2)];
    for (const std::vector<int>& carrier : carriers) {
      if (!MayFollow(carrier, data.signals[s])) continue;
      Eigen::MatrixXd columns =
          problem.Carried(carrier, Polynomials(problem, all, s, degree).rightCols(degree));
      problem.Project(columns);
      Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
      qr.setThreshold(1e-6);
      bases[s].push_back(qr.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), qr.rank()));
    }
  }
  // The gain of a basis, standardised by its mean and standard deviation under noise.
  const auto statistic = [](const Eigen::MatrixXd& basis, const Eigen::VectorXd& r) {
    if (basis.cols() == 0) return 0.0;
    const double rank = static_cast<double>(basis.cols());
    return ((basis.transpose() * r).squaredNorm() - rank) / std::sqrt(2 * rank);
  };
  Indexed<SignalIndex, double> observed(data.signals.size(), 0.0), shares = observed;
  const double total = std::max(1e-12, residual.squaredNorm());
  for (const SignalIndex s : bases.indices()) {
    for (const Eigen::MatrixXd& basis : bases[s]) {
      observed[s] = std::max(observed[s], statistic(basis, residual));
      shares[s] = std::max(shares[s], (basis.transpose() * residual).squaredNorm() / total);
    }
  }
  Indexed<SignalIndex, int> beaten(data.signals.size(), 0);
  Random random(20240607);
  for (int flip = 0; flip < flips; ++flip) {
    std::map<ClusterIndex, double> signs;
    Eigen::VectorXd flipped = residual;
    for (const FitRowIndex j : problem.rows().indices()) {
      const ClusterIndex cluster = data.cluster_of[problem.rows()[j]];
      const auto [sign, inserted] = signs.emplace(cluster, 0.0);
      if (inserted) sign->second = random.Sign();
      problem.layout().PartOf(flipped, j) *= sign->second;
    }
    double largest = 0;
    for (const auto& of_signal : bases) {
      for (const Eigen::MatrixXd& basis : of_signal) {
        largest = std::max(largest, statistic(basis, flipped));
      }
    }
    for (const SignalIndex s : observed.indices()) beaten[s] += largest >= observed[s] ? 1 : 0;
  }
  std::vector<SignalTrace> traces;
  for (const SignalIndex s : data.signals.indices()) {
    traces.push_back({data.signals[s].column, data.signals[s].values,
                      (1.0 + beaten[s]) / (1.0 + flips), shares[s]});
  }
  return traces;
}

constexpr int kSignalRows = 1000;  // rows used to test the signals

Verdict VerdictOfSearch(const Identified& found, const Diagnosis& diagnosis) {
  if (found.unknown) {
    return diagnosis.rival_drivers.empty() ? Verdict::kUnknown : Verdict::kAmbiguous;
  }
  if (found.best.blocks.empty()) return Verdict::kNoEffect;
  return diagnosis.rivals.empty() ? Verdict::kExplained : Verdict::kAmbiguous;
}

void AddEach(const std::vector<std::string>& columns, std::vector<std::string>& known) {
  for (const std::string& column : columns) {
    if (std::ranges::find(known, column) == known.end()) known.push_back(column);
  }
}

/// Adds the signals of empirical terms and of their rivals, then those that the residual follows.
void AddDrivers(const Identified& found, bool rough, Diagnosis& diagnosis) {
  for (const BlockIndex block : found.best.blocks) {
    const Block& own = found.candidate_set->blocks()[block];
    if (!found.unknown || !own.empirical()) continue;
    AddEach(own.term.drivers, diagnosis.drivers);
  }
  for (const std::vector<std::string>& rivals : diagnosis.rival_drivers) {
    AddEach(rivals, diagnosis.drivers);
  }
  if (!rough) return;
  for (const SignalTrace& signal : diagnosis.signals) {
    const bool named = std::ranges::find(diagnosis.drivers, signal.name) != diagnosis.drivers.end();
    if (signal.p_value <= kSignalSignificance && !named) diagnosis.drivers.push_back(signal.name);
  }
}

/// True if the cell or the rows state the noise.
bool NoiseStated(const Dataset& data) {
  return data.cell.measurement.sigma_m || data.row_sigma_m;
}

/// Repeats that scatter more than the declared noise, unless the named effects explain that.
void AddRepeatNote(const Dataset& data, bool explained, Diagnosis& diagnosis) {
  constexpr double kMore = 2;
  if (explained || !NoiseStated(data) || data.repeat_sigma_m <= kMore * data.sigma_m) return;
  diagnosis.notes.push_back(fmt::format(
      "repeated points scatter by {:.3g} mm, more than {}: check the instrument, or what moved "
      "between the repeats",
      1e3 * data.repeat_sigma_m,
      data.row_sigma_m
          ? fmt::format("the {:.3g} mm of the column sigma_mm (median)", 1e3 * data.sigma_m)
          : fmt::format("the declared sigma_mm = {:.3g}", 1e3 * data.sigma_m)));
}

/// Sizes of the residuals, divided by the median size under unit noise so that rows with different
/// numbers of residuals can be compared.
PerRow<double> SizesOf(const Dataset& data, const FitOfAllRows& fit) {
  const PerRow<RowResidual> residuals = ResidualsOf(fit.linear);
  PerRow<double> sizes;
  for (const RowIndex row : data.row_indices())
    sizes.push_back(SizeOf(data.numbers[row], residuals[row]) /
                    MedianOfChi(std::max(1, data.numbers[row].count)));
  return sizes;
}

/// What rows under a condition that were rejected may have in common, and what to do.
const char* WordsOf(const RowCondition& condition) {
  if (condition.column == "artefact")
    return "it may have moved, or it is loose; fasten it and measure again";
  if (condition.column == "camera")
    return "it may have moved, or its lens or tags are wrong; calibrate it again and measure more "
           "rows with it";
  if (condition.column == "tool")
    return "its tip, its stiffness or its mount may be wrong; measure its TCP again";
  if (condition.column == "payload_item")
    return "its mass or its centre of gravity may be wrong; weigh it";
  if (condition.column == "session")
    return "the instrument, its frame or the tool may have changed; check what differs there";
  if (condition.column == "kind")
    return "these rows contradict the others; check the instrument that measured them, its frame "
           "and the tool";
  return "an effect acts only there, or the noise is larger there. Measure more rows there to "
         "distinguish these; if it is noise, state that of each row in the column sigma_mm";
}

/// True if a condition holds for some rows, but not for more than half of them.
bool LeavesMostRows(const Dataset& data, const RowCondition& condition) {
  const IndexRange<RowIndex> rows = data.row_indices();
  const auto meeting =
      std::ranges::count_if(rows, [&](RowIndex row) { return Meets(condition, data, row); });
  return meeting > 0 && 2 * meeting <= data.rows();
}

/// "lines 12 to 40": where rows are in the file.
std::string LinesText(const Dataset& data, const LargerResiduals& rows) {
  return fmt::format("lines {} to {}", data.measured(rows.first).line,
                     data.measured(rows.last).line);
}

/// Note on residuals that are larger under a condition.
std::string NoteOf(const Dataset& data, const LargerUnderCondition& larger, const Misfit& misfit) {
  const std::string text = fmt::format(
      "residuals of the {} poses with {} are {:.1f} times as large as those of the other "
      "{} (medians)",
      larger.poses, TextOf(larger.condition), larger.ratio, larger.of_poses - larger.poses);
  if (misfit.certain) return text + ": " + WordsOf(larger.condition);
  return fmt::format(
      "{}, but they were measured in only {} of time, within {}: a disturbance of the instrument "
      "then would do the same.{} Measure some of them again at another time",
      text, larger.stretches == 1 ? "one stretch" : "two stretches", LinesText(data, larger),
      misfit.outside_domain ? " Such points are outside [domain]." : "");
}

/// Adds larger residuals under a condition, or for a while, whichever chance explains less.
void AddLargerResiduals(const Dataset& data, const FitOfAllRows& fit, Diagnosis& diagnosis) {
  const PerRow<double> sizes = SizesOf(data, fit);
  const auto larger = FindLargerUnderCondition(data, sizes);
  const auto briefly = FindLargerForAWhile(data, sizes);
  if (larger && !(briefly && briefly->p_value < larger->p_value)) {
    const bool certain = !data.table.recorded.order || larger->stretches >= kMinStretches;
    diagnosis.misfit = {larger->condition, true, certain, LeavesMostRows(data, larger->condition)};
    diagnosis.notes.push_back(NoteOf(data, *larger, *diagnosis.misfit));
  } else if (briefly) {
    diagnosis.notes.push_back(fmt::format(
        "residuals of {} successive poses ({}) are {:.1f} times as large as those of the other {} "
        "(medians): the instrument or the arm was disturbed then, or these poses have in common "
        "what the model does not fit. The radius does not cover such errors; find out what "
        "happened, and measure these poses again",
        briefly->poses, LinesText(data, *briefly), briefly->ratio,
        briefly->of_poses - briefly->poses));
  }
}

/// Rows under a condition that were rejected, or whose residuals are larger: what acts there is
/// unknown.
/// Loads of gravity are considered up to the number of rows that are searched.
void AddMisfit(const Identified& identified, const FitOfAllRows& fit, Diagnosis& diagnosis) {
  const Dataset& data = fit.problem.data;
  const bool searched_all = identified.fit.data.rows() == data.rows();
  const std::vector<RowQuantity> loads =
      searched_all ? GravityLoadsAt(data, *identified.linear) : std::vector<RowQuantity>();
  if (const auto found = ConditionOfOutliers(data, fit.problem.weights, loads)) {
    diagnosis.misfit = {found->condition, false, true, LeavesMostRows(data, found->condition)};
    diagnosis.notes.push_back(fmt::format("{} of the {} rows with {} are rejected as outliers: {}",
                                          found->rejected, found->rows, TextOf(found->condition),
                                          WordsOf(found->condition)));
  } else {
    AddLargerResiduals(data, fit, diagnosis);
  }
  if (!diagnosis.misfit || !diagnosis.misfit->certain) return;
  AddEach({diagnosis.misfit->condition.column}, diagnosis.drivers);
  diagnosis.verdict = Verdict::kUnknown;
}

ExplanationCheck LackOfFitCheck(const LackOfFit& found) {
  ExplanationCheck check;
  check.name = "lack_of_fit";
  check.figure = 1e3 * found.between_poses_m;
  check.limit = 1e3 * found.limit_m;
  check.passed = !found.significant();
  check.sentence = fmt::format(
      "residuals differ between poses by {:.3g} mm per axis, scaled to one row; repeated points "
      "scatter by {:.3g} mm, and a noise of {:.3g} mm accounts for at most {:.3g} mm (F test with "
      "{:.0f} and {:.0f} degrees of freedom, 0.1 %)",
      check.figure, 1e3 * found.replicates_m, 1e3 * found.noise_m, check.limit,
      found.between_poses_freedom, found.replicates_freedom);
  return check;
}

/// Adds the check `lack_of_fit` if there are enough replicates. If it fails, the residual is not
/// noise, whatever was declared.
void CheckLackOfFit(const Identified& found, const FitOfAllRows& fit, Diagnosis& diagnosis) {
  const Dataset& data = fit.problem.data;
  const auto lack = LackOfFitOf(data, ResidualsOf(fit.linear), fit.problem.weights,
                                found.fit.row_correlation, ParametersOf(found, data));
  if (!lack) return;
  diagnosis.checks.push_back(LackOfFitCheck(*lack));
  if (!lack->significant()) return;
  diagnosis.notes.push_back(diagnosis.checks.back().sentence);
  diagnosis.verdict = Verdict::kUnknown;
}

ExplanationCheck LoadDirectionCheck(const LoadDirection& found) {
  ExplanationCheck check;
  check.name = "load_direction";
  check.effect = found.effect;
  check.figure = found.t;
  check.limit = found.limit;
  check.passed = !found.significant();
  std::vector<std::string> axes;
  axes.reserve(found.tested.size());
  for (const int joint : found.tested) axes.push_back(std::to_string(joint + 1));
  check.sentence = fmt::format(
      "the residual does not follow the size of the gravity torque of axis {} (largest t = {:.1f}, "
      "limit {:.1f}); an axis whose torque has one direction in all rows is not tested",
      Listed(axes), found.t, found.limit);
  if (check.passed) return check;
  check.sentence = fmt::format(
      "axis {0}: the residual follows the size of its gravity torque (t = {1:.1f}, at most {2:.1f} "
      "by chance), as if it yielded by {3:.2g} rad/(N m) under a positive torque and by {4:.2g} "
      "under a negative one; a compliance that depends on the direction of the load, or "
      "friction on arrivals from one side, would do this",
      found.joint + 1, found.t, found.limit, found.positive, found.negative);
  return check;
}

/// Adds the check `load_direction` if a compliance is named. If it fails, one compliance does not
/// explain the joint's deflection.
void CheckLoadDirection(const Identified& found, Diagnosis& diagnosis) {
  const auto direction = LargestLoadDirection(found);
  if (!direction) return;
  diagnosis.checks.push_back(LoadDirectionCheck(*direction));
  if (!direction->significant()) return;
  diagnosis.notes.push_back(diagnosis.checks.back().sentence);
  AddEach({fmt::format("tau{}_Nm", direction->joint + 1)}, diagnosis.drivers);
  diagnosis.verdict = Verdict::kUnknown;
}

/// Rejected rows that one effect explains are another regime; drivers of open-world rivals make the
/// answer unknown.
void CheckOpenWorld(const Identified& found, Diagnosis& diagnosis) {
  if (const auto regime = RegimeOfRejectedRows(found)) {
    diagnosis.notes.push_back(fmt::format(
        "the {} rejected rows are hardly gross errors: {} in these rows only explains {} of their "
        "squares; they differ from the others most in {}. What acts there is not corrected: "
        "measure "
        "more such poses",
        regime->rows, regime->effect, PercentText(regime->share), regime->driver));
    AddEach({regime->driver}, diagnosis.drivers);
  }
  if (!found.unknown && !diagnosis.drivers.empty()) diagnosis.verdict = Verdict::kUnknown;
}

}  // namespace

double ParametersOf(const Identified& found, const Dataset& data) {
  const Nuisances nuisances(data);
  return static_cast<double>(found.best.columns.size()) + nuisances.size() - nuisances.equations();
}

void AddSignals(const Dataset& all, const Identified& found, Diagnosis& diagnosis) {
  const LinearProblem subset(found.fit.WithRows(EvenlySpacedRows(found.fit.data, kSignalRows)),
                             found.linear, found.model);
  CandidateSet candidate_set(subset);
  std::vector<BlockIndex> support;
  for (const BlockIndex block : found.best.blocks) {
    support.push_back(candidate_set.Add(found.candidate_set->blocks()[block]));
  }
  const Eigen::VectorXd residual = candidate_set.Residual(candidate_set.Fit(support));
  diagnosis.signals = TestSignals(subset, residual, kSignFlips);
  for (const SignalIndex s : all.signals.indices()) {
    diagnosis.signals[s.offset()].values = all.signals[s].values;
  }
  for (const PeriodicLine& line : PeriodicLines(subset, residual)) {
    diagnosis.spectrum.push_back({line.joint, line.cycles_per_turn, line.amplitude_rad});
  }
}

void SetVerdict(const Identified& found, const FitOfAllRows& fit, Diagnosis& diagnosis) {
  const Dataset& data = fit.problem.data;
  const double residual_sigma_m = RobustSigma(data, ResidualsOf(fit.linear));
  const bool rough = data.sigma_m > 0 && residual_sigma_m >= kExcessNoiseRatio * data.sigma_m;
  diagnosis.verdict = VerdictOfSearch(found, diagnosis);
  AddDrivers(found, rough, diagnosis);
  AddRepeatNote(data, !rough && !found.best.blocks.empty(), diagnosis);
  AddMisfit(found, fit, diagnosis);
  CheckLackOfFit(found, fit, diagnosis);
  CheckLoadDirection(found, diagnosis);
  CheckOpenWorld(found, diagnosis);
  if (!rough) return;
  diagnosis.notes.push_back(
      fmt::format("the residual, {:.3g} mm per axis, is {:.1f} times the noise of {:.3g} mm{}",
                  1e3 * residual_sigma_m, residual_sigma_m / data.sigma_m, 1e3 * data.sigma_m,
                  data.row_sigma_m ? " (" + data.sigma_origin + ")" : std::string()));
  if (!diagnosis.drivers.empty()) diagnosis.verdict = Verdict::kUnknown;
  diagnosis.declared_noise_too_small = diagnosis.verdict != Verdict::kUnknown && NoiseStated(data);
}

}  // namespace plumbline::measure
