#include "app/measure/diagnosis/hypotheses/gross_errors.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/hypotheses/mistakes.h"
#include "app/measure/diagnosis/hypotheses/unit_segment.h"
#include "app/measure/diagnosis/linear/alignment.h"
#include "app/measure/diagnosis/linear/robust.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

constexpr double kAlternativeRatio =
    1.5;  // largest ratio to the best score of a reported alternative
constexpr double kFreeParameterRatio =
    1.5;                             // required advantage of a hypothesis with free parameters
constexpr double kNoiseRatio = 1.5;  // largest residual that counts as noise, in declared sigma
constexpr double kSubtleRatio = 3;   // required reduction of the residual by a subtle mistake
constexpr int kMaxComparedRows = 60;
constexpr std::size_t kMaxReported = 3;

double MedianResidual(const Linearisation& linear) {
  std::vector<double> sizes;
  for (const Vec3& error : ErrorsOf(linear)) sizes.push_back(error.norm());
  return statistics::MedianOf(sizes);
}

/// True if several rows, more than a few misread ones, are farther away than effects can move them.
bool SomeRowsAreGross(const Linearisation& linear) {
  constexpr int kMinGross = 4;
  const PerRow<Vec3> errors = ErrorsOf(linear);
  return std::ranges::count_if(
             errors, [](const Vec3& error) { return error.norm() >= kGross_m; }) >= kMinGross;
}

/// Fit of the data with one mistake corrected.
struct EditTrial {
  const Mistake* mistake = nullptr;
  double residual_m = HUGE_VAL;  ///< median
  double sigma_m = HUGE_VAL;     ///< robust, one axis
  PerRow<RowResidual> residuals;
  Model model;
  Model::Frames declared;
  std::vector<model::SessionTip> moved_tips;  ///< of the first session, with the declared ones
};

/// The tips of the first session that the fit moved.
std::vector<model::SessionTip> MovedTips(const Dataset& data, const Model& fitted,
                                         const Model::Frames& declared) {
  constexpr double kMoved_m = 1e-3;
  std::vector<model::SessionTip> tips;
  for (int tool = 0; tool < data.cell.tools(); ++tool) {
    const Vec3 p_F = fitted.frames.front().X_FT[tool].p, declared_F = declared.X_FT[tool].p;
    if ((p_F - declared_F).norm() < kMoved_m) continue;
    tips.push_back({deflection::SessionTipNumber(data.cell, tool), p_F, declared_F});
  }
  return tips;
}

EditTrial RunTrial(Dataset changed, int threads) {
  EditTrial trial;
  const Model start = Model::Declared(changed);
  trial.declared = start.frames.front();
  const Result<Model> model = Align(changed, start, threads);
  if (!model) return trial;
  const Result<Linearisation> linear = Linearise(changed, *model, false, threads);
  if (!linear) return trial;
  trial.model = *model;
  trial.moved_tips = MovedTips(changed, *model, trial.declared);
  trial.residual_m = MedianResidual(*linear);
  trial.residuals = ResidualsOf(*linear);
  trial.sigma_m = RobustSigma(changed, trial.residuals);
  if (!std::isfinite(trial.residual_m)) trial.residual_m = HUGE_VAL;
  return trial;
}

Dataset CorrectedRows(Dataset data, const std::function<void(Dataset&)>& undo) {
  undo(data);
  return data;
}

/// An evenly spaced subset of the rows, sufficient for a median.
Dataset Subset(const Dataset& data) {
  return data.rows() <= kMaxComparedRows
             ? data
             : SelectRows(data, EvenlySpacedRows(data, kMaxComparedRows));
}

std::string MillimetresText(const Vec3& v_m) {
  return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", 1e3 * v_m.x(), 1e3 * v_m.y(), 1e3 * v_m.z());
}

std::string SentenceOf(const EditTrial& trial) {
  if (!trial.mistake->fits()) return trial.mistake->sentence;
  const Model::Frames& found = trial.model.frames.front();
  if (trial.mistake->fits_tip) {
    std::vector<std::string> moved;
    for (const model::SessionTip& tip : trial.moved_tips) {
      moved.push_back(fmt::format("the TCP{} is {} from the declared one",
                                  tip.tool ? fmt::format(" of tool {}", *tip.tool) : "",
                                  MillimetresText(tip.p_F - *tip.declared_F)));
    }
    return fmt::format("{}, in the flange frame", fmt::join(moved, " and "));
  }
  const Mat3 R = found.X_WB.R * trial.declared.X_WB.R.transpose();
  const double angle_deg = VectorFromRotation(R).norm() / kRadPerDeg;
  return fmt::format("the robot's base is {} from the declared position and rotated by {:.2f} deg",
                     MillimetresText(found.X_WB.p - trial.declared.X_WB.p), angle_deg);
}

/// Median residual, increased for hypotheses with free parameters.
double ScoreOf(const EditTrial& trial) {
  return trial.residual_m * (trial.mistake->fits() ? kFreeParameterRatio : 1.0);
}

/// Distances of a point from all others, ascending: the same in every frame and order of the rows.
using DistanceProfile = Eigen::VectorXd;

std::vector<DistanceProfile> ProfilesOf(const std::vector<Vec3>& points) {
  std::vector<DistanceProfile> profiles;
  for (const Vec3& p : points) {
    DistanceProfile& own =
        profiles.emplace_back(DistanceProfile(static_cast<Eigen::Index>(points.size())));
    for (Eigen::Index k = 0; k < own.size(); ++k) own[k] = (p - points[k]).norm();
    std::sort(own.begin(), own.end());
  }
  return profiles;
}

/// The one-to-one assignment by ascending difference of the profiles: for each tip its point.
std::vector<int> AssignedPoints(const std::vector<Vec3>& points, const std::vector<Vec3>& tips) {
  struct Pair {
    double difference;
    int tip, point;
  };
  const auto of_points = ProfilesOf(points), of_tips = ProfilesOf(tips);
  const auto count = static_cast<int>(points.size());
  std::vector<Pair> pairs;
  for (int tip = 0; tip < count; ++tip) {
    for (int point = 0; point < count; ++point) {
      pairs.push_back({(of_tips[tip] - of_points[point]).lpNorm<1>(), tip, point});
    }
  }
  std::ranges::sort(pairs, {}, &Pair::difference);
  std::vector<int> assigned(points.size(), -1);
  std::vector<bool> taken(points.size(), false);
  for (const Pair& pair : pairs) {
    if (assigned[pair.tip] >= 0 || taken[pair.point]) continue;
    assigned[pair.tip] = pair.point;
    taken[pair.point] = true;
  }
  return assigned;
}

/// The measured points assigned anew to the postures, by their distances from each other; nullopt
/// if the rows are too many or not all positions.
std::optional<Dataset> Reordered(const Dataset& data, const Linearisation& aligned) {
  constexpr int kMinRows = 8, kMaxRows = 400;
  if (data.rows() < kMinRows || data.rows() > kMaxRows) return std::nullopt;
  std::vector<Vec3> points, tips;
  for (const RowIndex row : data.row_indices()) {
    const std::optional<Vec3>& measured_W = data.measured(row).measured_W;
    if (!measured_W) return std::nullopt;
    points.push_back(*measured_W);
    tips.push_back(aligned.rows[row].p_W);
  }
  const std::vector<int> assigned = AssignedPoints(points, tips);
  Dataset changed = data;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const MeasuredRow& source = data.table.rows[static_cast<std::size_t>(assigned[k])];
    changed.table.rows[k].measured_W = source.measured_W;
    changed.table.rows[k].orientation_W = source.orientation_W;
  }
  return changed;
}

/// Mean over the rows of min(|r|, 25 mm), which also some rows in another order increase.
double MeanLossOf(const PerRow<RowResidual>& residuals) {
  double sum = 0;
  for (const RowResidual& residual : residuals) {
    const double length = LengthsOf(residual).norm();
    sum += std::isfinite(length) ? std::min(length, kGross_m) : kGross_m;
  }
  return sum / static_cast<double>(std::max<std::size_t>(1, residuals.size()));
}

/// A sentence if the measured points explain the joint readings in another order; nullopt
/// otherwise.
std::optional<std::string> OtherOrder(const Dataset& data, const Linearisation& aligned,
                                      int threads) {
  const std::optional<Dataset> reordered = Reordered(data, aligned);
  if (!reordered) return std::nullopt;
  const EditTrial trial = RunTrial(*reordered, threads);
  if (trial.residuals.empty() ||
      !(MeanLossOf(trial.residuals) < kExplainedRatio * MeanLossOf(ResidualsOf(aligned)))) {
    return std::nullopt;
  }
  int moved = 0;
  for (const RowIndex row : data.row_indices()) {
    moved += data.measured(row).measured_W != reordered->measured(row).measured_W ? 1 : 0;
  }
  return fmt::format(
      "it falls to {:.2f} mm if {} of the {} points belong to the joint readings of other rows: "
      "measurements and joint readings are in different orders; put those of the same moment into "
      "one row",
      1e3 * trial.residual_m, moved, data.rows());
}

/// The subset with a mistake undone, before thinning where the mistake moves values between rows.
Dataset CorrectedSubset(const Dataset& data, const Dataset& subset, const Mistake& mistake) {
  return mistake.needs_all_rows ? Subset(CorrectedRows(data, mistake.undo))
                                : CorrectedRows(subset, mistake.undo);
}

/// The coupling of two joints, by whatever ratio, that explains gross errors best; nullopt if none
/// explains them.
std::optional<Mistake> FittedCoupling(const Dataset& subset, double before_m, int threads) {
  constexpr std::array kRatios = {0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.4, 2.0};
  constexpr int kNarrowings = 24;
  constexpr double kGolden = 0.6180339887498949;
  const auto residual = [&](model::JointCoupling pair, double ratio) {
    pair.ratio = ratio;
    return RunTrial(CorrectedRows(subset, CouplingMistake(subset, pair).undo), threads).residual_m;
  };
  model::JointCoupling best;
  double least_m = HUGE_VAL;
  for (const model::JointCoupling& pair : PossibleCouplings(subset)) {
    for (const double size : kRatios) {
      for (const double ratio : {size, -size}) {
        const double residual_m = residual(pair, ratio);
        if (!(residual_m < least_m)) continue;
        least_m = residual_m;
        best = {pair.joint, pair.of, ratio};
      }
    }
  }
  if (!(least_m < before_m)) return std::nullopt;
  double low = best.ratio / 2.5, high = best.ratio * 2.5;
  for (int k = 0; k < kNarrowings; ++k) {
    const double one = high - kGolden * (high - low), other = low + kGolden * (high - low);
    if (residual(best, one) < residual(best, other)) {
      high = other;
    } else {
      low = one;
    }
  }
  best.ratio = (low + high) / 2;
  if (!(residual(best, best.ratio) * kFreeParameterRatio < kExplainedRatio * before_m)) {
    return std::nullopt;
  }
  return CouplingMistake(subset, best);
}

GrossMistake GrossErrorIn(const Dataset& data, const Linearisation& aligned,
                          const std::vector<Mistake>& mistakes, double before_m, int threads) {
  const std::string found = fmt::format(
      "measured points are {:.0f} mm from the positions predicted by the declared cell (median)",
      1e3 * before_m);
  const Dataset subset = Subset(data);
  std::vector<EditTrial> all;
  for (const Mistake& mistake : mistakes) {
    all.push_back(RunTrial(CorrectedSubset(data, subset, mistake), threads));
    all.back().mistake = &mistake;
  }
  std::ranges::stable_sort(
      all, [](const EditTrial& a, const EditTrial& b) { return ScoreOf(a) < ScoreOf(b); });
  if (!(all.front().residual_m < kExplainedRatio * before_m)) {
    if (const auto order = OtherOrder(data, aligned, threads)) {
      return {found + "; " + *order, true};
    }
    if (const auto coupling = FittedCoupling(subset, before_m, threads)) {
      const double after_m = RunTrial(CorrectedRows(subset, coupling->undo), threads).residual_m;
      return {fmt::format("{}; it falls to {:.2f} mm if {}: {}", found, 1e3 * after_m,
                          coupling->sentence, coupling->remedy)};
    }
    return {found +
            ": no effect is that large, but an error of a frame may be; check the DH table, the "
            "units (mm, deg), the frame (is it \"unaligned\"?), that the measurement and the joint "
            "readings of each row belong together, and that the data belong to this cell"};
  }
  std::string text =
      fmt::format("{}; it falls to {:.2f} mm if {}: {}", found, 1e3 * all.front().residual_m,
                  SentenceOf(all.front()), all.front().mistake->remedy);
  for (std::size_t k = 1; k < std::min(kMaxReported, all.size()); ++k) {
    if (ScoreOf(all[k]) > kAlternativeRatio * ScoreOf(all.front())) break;
    text += fmt::format("; or, which these rows cannot distinguish from it, {}: {}",
                        SentenceOf(all[k]), all[k].mistake->remedy);
  }
  return {text, all.front().mistake->needs_all_rows && !all.front().mistake->subtle};
}

/// Robust sigma of the rows that a mistake affects. If these are fewer than half of all rows, the
/// median over all rows would not show it.
double SigmaOfAffected(const Dataset& data, const EditTrial& trial, const Mistake& mistake) {
  if (!mistake.affects || trial.residuals.empty()) return trial.sigma_m;
  FitRows rows;
  PerRow<RowResidual> residuals;
  for (const RowIndex row : data.row_indices()) {
    if (!mistake.affects(data.measured(row))) continue;
    rows.push_back(row);
    residuals.push_back(trial.residuals[row]);
  }
  return RobustSigma(SelectRows(data, rows), residuals);
}

std::optional<std::string> SubtleErrorText(const Dataset& data,
                                           const std::vector<Mistake>& mistakes,
                                           double sigma_before_m, int threads) {
  const Dataset subset = Subset(data);
  const double noise_m = kNoiseRatio * subset.sigma_m;
  const auto is_large = [&](double sigma_m) { return sigma_m >= kSubtleRatio * subset.sigma_m; };
  const bool some_affect_part = std::ranges::any_of(
      mistakes, [](const Mistake& mistake) { return mistake.subtle && mistake.affects; });
  if (subset.sigma_m <= 0 || !(is_large(sigma_before_m) || some_affect_part)) return std::nullopt;
  const EditTrial as_read = some_affect_part ? RunTrial(subset, threads) : EditTrial{};
  for (const Mistake& mistake : mistakes) {
    if (!mistake.subtle) continue;
    const double before_m =
        mistake.affects ? SigmaOfAffected(subset, as_read, mistake) : sigma_before_m;
    if (!is_large(before_m)) continue;
    const EditTrial trial = RunTrial(CorrectedSubset(data, subset, mistake), threads);
    const double after_m = SigmaOfAffected(subset, trial, mistake);
    if (std::max(after_m, trial.sigma_m) > std::min(noise_m, before_m / kSubtleRatio)) continue;
    const bool alternative_fits =
        std::ranges::any_of(mistake.alternatives, [&](const std::function<void(Dataset&)>& undo) {
          return RunTrial(CorrectedRows(subset, undo), threads).sigma_m < noise_m;
        });
    if (alternative_fits) continue;
    return fmt::format(
        "the residual of the declared cell{} is {:.3g} mm on one axis; it falls to {:.3g} mm, the "
        "noise, if {}: {}",
        mistake.affects ? " in those rows" : "", 1e3 * before_m, 1e3 * after_m, mistake.sentence,
        mistake.remedy);
  }
  return std::nullopt;
}

}  // namespace

std::optional<GrossMistake> GrossError(const Dataset& data, const Linearisation& aligned,
                                       int threads) {
  const double before_m = MedianResidual(aligned);
  if (SomeRowsAreGross(aligned)) {
    if (const auto changed = ChangedUnit(data, threads)) return GrossMistake{*changed};
    if (before_m < kGross_m) {
      if (const auto order = OtherOrder(data, aligned, threads))
        return GrossMistake{"some points are far from the predicted positions; " + *order, true};
    }
  }
  const std::vector<Mistake> mistakes = MistakesOf(data);
  if (before_m >= kGross_m) return GrossErrorIn(data, aligned, mistakes, before_m, threads);
  const auto subtle =
      SubtleErrorText(data, mistakes, RobustSigma(data, ResidualsOf(aligned)), threads);
  return subtle ? std::optional(GrossMistake{*subtle}) : std::nullopt;
}

Result<DeclaredFit> FitDeclared(const Dataset& data, int threads) {
  // With values in a wrong unit, the deflection of the arm may not converge.
  const auto failed = [&](const std::string& error) {
    return Error{ChangedUnit(data, threads).value_or(error)};
  };
  Result<Model> aligned = Align(data, Model::Declared(data), threads);
  if (!aligned) return failed(aligned.error());
  Result<Linearisation> linear = Linearise(data, *aligned, false, threads);
  if (!linear) return failed(linear.error());
  auto mistake = GrossError(data, *linear, threads);
  return DeclaredFit{std::move(aligned).value(), std::move(linear).value(), std::move(mistake)};
}

namespace {

constexpr int kMaxTrialRows =
    120;  // used to locate the change roughly; all rows around it locate it exactly

/// Maximum likelihood change point of the mean and variance of a column's numbers, taken as normal:
/// minimises n_1 ln s_1^2 + n_2 ln s_2^2.
std::optional<RowIndex> ChangePoint(const Dataset& data, const OtherUnit& other) {
  const int rows = data.rows();
  if (rows < 2 * kMinRowsPerSide) return std::nullopt;
  std::vector<double> costs(static_cast<std::size_t>(rows) + 1, 0.0);
  for (const auto& number : other.numbers) {
    std::vector<double> sum = {0}, squares = {0};
    double largest = 0;
    for (const MeasuredRow& row : data.table.rows)
      largest = std::max(largest, std::abs(number(row)));
    if (largest == 0) continue;
    for (const MeasuredRow& row : data.table.rows) {
      const double value = number(row) / largest;
      sum.push_back(sum.back() + value);
      squares.push_back(squares.back() + value * value);
    }
    const auto part = [&](std::size_t first, std::size_t last) {
      constexpr double kRounding = 1e-10;  // of a variance, relative to the largest square
      const auto n = static_cast<double>(last - first);
      const double mean = (sum[last] - sum[first]) / n;
      const double variance = (squares[last] - squares[first]) / n - mean * mean;
      return n * std::log(std::max(variance, 0.0) + kRounding);
    };
    const auto end = static_cast<std::size_t>(rows);
    for (std::size_t k = kMinRowsPerSide; k + kMinRowsPerSide <= end; ++k) {
      costs[k] += part(0, k) + part(k, end);
    }
  }
  const auto first = costs.begin() + kMinRowsPerSide, last = costs.end() - kMinRowsPerSide;
  return RowIndex(std::min_element(first, last) - costs.begin());
}

/// Distance of each measured point from the predicted one [m]; infinite if the deflected posture
/// does not converge.
PerRow<double> DistancesAt(const Dataset& data, const Model& model) {
  const ModelAtRows at_rows(data, model);
  PerRow<double> distances;
  deflection::Sensitivity scratch;
  LinearRow at;
  Gradient none;
  for (const RowIndex row : data.row_indices()) {
    const bool settled = at_rows.At(row, {}, scratch, at, none);
    const double distance = settled ? LengthsOf(at.residual).norm() : HUGE_VAL;
    distances.push_back(std::isfinite(distance) ? distance : HUGE_VAL);
  }
  return distances;
}

double LossOf(double distance_m) {
  return std::min(distance_m, kGross_m);
}

/// The segment on one side with the smallest loss under a model; of equal ones the shortest, so
/// that converting the row at its end reduces the loss.
RowSegment SegmentOfLeastLoss(const Dataset& data, const OtherUnit& other, const Model& model,
                              bool from) {
  Dataset converted = data;
  for (const RowIndex row : data.row_indices()) other.convert(converted, row);
  const PerRow<double> as_read = DistancesAt(data, model);
  const PerRow<double> as_converted = DistancesAt(converted, model);
  double gain = 0, most = 0;  // reduction of the loss by converting the rows so far
  RowSegment best{RowIndex(from ? data.rows() : 0), from};
  const auto update = [&](RowIndex change) {
    if (!(gain > most + 1e-9 * kGross_m)) return;
    most = gain;
    best.change = change;
  };
  if (from) {
    for (int k = data.rows(); k-- > 0;) {
      const RowIndex row(k);
      gain += LossOf(as_read[row]) - LossOf(as_converted[row]);
      update(row);
    }
  } else {
    for (const RowIndex row : data.row_indices()) {
      gain += LossOf(as_read[row]) - LossOf(as_converted[row]);
      update(RowIndex(row.value() + 1));
    }
  }
  return best;
}

/// A unit change and the errors with it corrected.
struct UnitTrial {
  const OtherUnit* other = nullptr;
  LineSegment lines;
  int changed = 0;                   ///< number of converted rows
  double before_m = 0, after_m = 0;  ///< median distance of those rows
  double loss_m = HUGE_VAL;          ///< mean over all rows
};

class UnitChangeSearch {
 public:
  UnitChangeSearch(const Dataset& data, int threads)
      : data_(data),
        subset_(SelectRows(data, EvenlySpacedRows(data, kMaxTrialRows))),
        threads_(threads) {
    const Result<Model> model = Align(subset_, Model::Declared(subset_), threads_);
    if (model) {
      as_read_ = DistancesAt(subset_, *model);
    } else {
      as_read_.assign(subset_.rows(), HUGE_VAL);
    }
  }

  bool HasGrossRows() const {
    return std::ranges::count_if(as_read_, [](double distance_m) {
             return distance_m >= kGross_m;
           }) >= kMinRowsPerSide;
  }

  std::optional<UnitTrial> Best() const {
    std::optional<UnitTrial> best;
    for (const OtherUnit& other : others_) {
      for (const bool from : {true, false}) {
        const std::optional<UnitTrial> trial = RunTrial(other, from);
        if (trial && (!best || trial->loss_m < best->loss_m)) best = trial;
      }
    }
    return best;
  }

 private:
  std::optional<UnitTrial> RunTrial(const OtherUnit& other, bool from) const;
  /// Nothing if the change does not explain the gross errors.
  /// @param distances  of the subset's rows with the change corrected
  std::optional<UnitTrial> Judge(const OtherUnit& other, const RowSegment& segment,
                                 const Model& model, const PerRow<double>& distances) const;
  LineSegment ExactLines(const OtherUnit& other, const RowSegment& segment,
                         const Model& model) const;

  const Dataset& data_;
  Dataset subset_;
  int threads_;
  PerRow<double> as_read_;
  std::vector<OtherUnit> others_ = OtherUnits(data_);
};

/// Locates the change exactly among all rows around its position in the subset.
LineSegment UnitChangeSearch::ExactLines(const OtherUnit& other, const RowSegment& segment,
                                         const Model& model) const {
  const int before = std::max(0, segment.change.value() - 2);
  const int after = std::min(subset_.rows() - 1, segment.change.value() + 1);
  const int first_line = subset_.measured(RowIndex(before)).line;
  const int last_line = subset_.measured(RowIndex(after)).line;
  FitRows around;
  for (const RowIndex row : data_.row_indices()) {
    const int line = data_.measured(row).line;
    if (line >= first_line && line <= last_line) around.push_back(row);
  }
  const Dataset rows = SelectRows(data_, around);
  const RowSegment exact = SegmentOfLeastLoss(rows, other, model, segment.from);
  const int changed = exact.Count(rows.rows());
  return changed > 0 ? LinesOf(rows, exact) : LinesOf(subset_, segment);
}

std::optional<UnitTrial> UnitChangeSearch::RunTrial(const OtherUnit& other, bool from) const {
  const std::optional<RowIndex> start = ChangePoint(subset_, other);
  if (!start) return std::nullopt;
  RowSegment segment{*start, from};
  Model model = Model::Declared(subset_);
  PerRow<double> distances;
  constexpr int kRounds = 3;  // of frames given the change, and the change given the frames
  for (int round = 0; round < kRounds; ++round) {
    Dataset changed = subset_;
    Convert(other, LinesOf(subset_, segment), changed);
    const Result<Model> aligned = Align(changed, Model::Declared(changed), threads_);
    if (!aligned) return std::nullopt;
    model = *aligned;
    distances = DistancesAt(changed, model);
    const RowSegment better = SegmentOfLeastLoss(subset_, other, model, from);
    if (!better.IsLong(subset_.rows())) return std::nullopt;
    if (better.change == segment.change) break;
    segment = better;
  }
  return Judge(other, segment, model, distances);
}

std::optional<UnitTrial> UnitChangeSearch::Judge(const OtherUnit& other, const RowSegment& segment,
                                                 const Model& model,
                                                 const PerRow<double>& distances) const {
  UnitTrial trial{&other, ExactLines(other, segment, model), segment.Count(subset_.rows()), 0, 0,
                  0};
  std::vector<double> before, after;
  int gross = 0;
  for (const RowIndex row : subset_.row_indices()) {
    gross += distances[row] >= kGross_m ? 1 : 0;
    trial.loss_m += LossOf(distances[row]) / subset_.rows();
    if (!segment.Contains(row)) continue;
    before.push_back(as_read_[row]);
    after.push_back(distances[row]);
  }
  trial.before_m = statistics::MedianOf(before);
  trial.after_m = statistics::MedianOf(after);
  const bool explains = trial.before_m >= kGross_m &&
                        trial.after_m < kExplainedRatio * trial.before_m &&
                        gross <= kMaxOutliers * subset_.rows();
  return explains ? std::optional(trial) : std::nullopt;
}

}  // namespace

std::optional<std::string> ChangedUnit(const Dataset& data, int threads) {
  const UnitChangeSearch search(data, threads);
  if (!search.HasGrossRows()) return std::nullopt;
  const std::optional<UnitTrial> found = search.Best();
  if (!found) return std::nullopt;
  const std::string as_read =
      std::isfinite(found->before_m)
          ? fmt::format(
                "as read, measured points in these rows are {:.0f} mm from the positions predicted "
                "by the declared cell (median)",
                1e3 * found->before_m)
          : std::string("as read, the posture of the arm in these rows cannot be computed");
  return fmt::format(
      "{} hold{} {} {}: {}; converted to {}, the distance is {:.2f} mm. Write {} in every row",
      found->other->columns, found->other->numbers.size() > 1 ? "" : "s", found->other->unit,
      found->lines.Phrase(), as_read, found->other->declared, 1e3 * found->after_m,
      found->other->declared);
}

}  // namespace plumbline::measure
