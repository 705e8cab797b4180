#include "app/diagnosis/gross_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/diagnosis/alignment.h"
#include "app/diagnosis/mistakes.h"
#include "app/diagnosis/robust.h"
#include "app/diagnosis/unit_changes.h"
#include "firmware-like/geometry/angle.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/statistics/median.h"

namespace plumbline::diagnosis {
namespace {

constexpr double kAlso = 1.5;         // of the least: hypotheses that do nearly as well are told
constexpr double kFitMustGain = 1.5;  // of a hypothesis that fits numbers over one that does not
constexpr double kNoise = 1.5;        // declared sigmas that still count as noise
constexpr double kSubtleFall = 3;     // what a small mistake leaves over what it explains
constexpr int kRows = 60;
constexpr std::size_t kMostTold = 3;

double MiddleResidual(const Linearisation& linear) {
  std::vector<double> sizes;
  for (const Vec3& error : ErrorsOf(linear)) sizes.push_back(error.norm());
  return statistics::MedianOf(sizes);
}

/// True where more rows than a misread one or two lie farther away than effects move them.
bool SomeAreFar(const Linearisation& linear) {
  constexpr int kFewest = 4;
  const PerRow<Vec3> errors = ErrorsOf(linear);
  return std::count_if(errors.begin(), errors.end(),
                       [](const Vec3& error) { return error.norm() >= kGross_m; }) >= kFewest;
}

/// The data as if a hypothesis were true, fitted.
struct Tried {
  const Mistake* mistake = nullptr;
  double residual_m = HUGE_VAL;  ///< median
  double sigma_m = HUGE_VAL;     ///< robust, one axis
  PerRow<RowResidual> residuals;
  Model model;
  Model::Frames declared;
};

Tried Try(Dataset changed, int threads) {
  Tried tried;
  const Model start = Model::Declared(changed);
  tried.declared = start.frames.front();
  const Result<Model> model = Align(changed, start, threads);
  if (!model) return tried;
  const Result<Linearisation> linear = Linearise(changed, *model, false, threads);
  if (!linear) return tried;
  tried.model = *model;
  tried.residual_m = MiddleResidual(*linear);
  tried.residuals = ResidualsOf(*linear);
  tried.sigma_m = RobustSigma(changed, tried.residuals);
  if (!std::isfinite(tried.residual_m)) tried.residual_m = HUGE_VAL;
  return tried;
}

Dataset Without(Dataset data, const std::function<void(Dataset&)>& undo) {
  undo(data);
  return data;
}

/// Rows enough for a median, spread evenly.
Dataset Few(const Dataset& data) {
  return data.rows() <= kRows ? data : SelectRows(data, EvenlySpacedRows(data, kRows));
}

std::string VectorText(const Vec3& v_m) {
  return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", 1e3 * v_m.x(), 1e3 * v_m.y(), 1e3 * v_m.z());
}

std::string SentenceOf(const Tried& tried) {
  if (!tried.mistake->fits()) return tried.mistake->sentence;
  const Model::Frames& found = tried.model.frames.front();
  if (tried.mistake->fits_tip) {
    return fmt::format("the TCP is {} from the declared one, in the flange frame",
                       VectorText(found.tip_F - tried.declared.tip_F));
  }
  const Mat3 R = found.X_WB.R * tried.declared.X_WB.R.transpose();
  const double angle_deg = VectorFromRotation(R).norm() / kRadPerDeg;
  return fmt::format("the robot's base lies {} from the declared place and is turned by {:.2f} deg",
                     VectorText(found.X_WB.p - tried.declared.X_WB.p), angle_deg);
}

/// A hypothesis with numbers to fit must do better to be as good.
double ScoreOf(const Tried& tried) {
  return tried.residual_m * (tried.mistake->fits() ? kFitMustGain : 1.0);
}

/// How near each measured point is to where any row puts the tip (median), where that is so near
/// that points and joints only stand in different orders: a fifth of what the points are apart.
std::optional<double> NearestOfAnyRow(const Dataset& data, const Linearisation& aligned,
                                      double before_m) {
  constexpr int kMost = 1000;
  if (data.ranges() || data.frames_free() || data.tip_free() || data.rows() > kMost) {
    return std::nullopt;
  }
  std::vector<double> nearest_m, apart_m;
  for (const RowIndex row : data.row_indices()) {
    const Vec3& p = data.measured(row).p_WT;
    double to_tip_m = HUGE_VAL, to_point_m = HUGE_VAL;
    for (const RowIndex other : data.row_indices()) {
      to_tip_m = std::min(to_tip_m, (p - aligned.rows[other].p_W).norm());
      if (other != row) to_point_m = std::min(to_point_m, (p - data.measured(other).p_WT).norm());
    }
    nearest_m.push_back(to_tip_m);
    apart_m.push_back(to_point_m);
  }
  const double middle_m = statistics::MedianOf(nearest_m);
  const bool in_other_order = middle_m < kNamed * std::min(before_m, statistics::MedianOf(apart_m));
  return in_other_order ? std::optional(middle_m) : std::nullopt;
}

std::string NameGross(const Dataset& data, const Linearisation& aligned,
                      const std::vector<Mistake>& mistakes, double before_m, int threads) {
  const std::string found =
      fmt::format("measured points lie {:.0f} mm from where the declared cell puts them (median)",
                  1e3 * before_m);
  const Dataset few = Few(data);
  std::vector<Tried> all;
  for (const Mistake& mistake : mistakes) {
    all.push_back(
        Try(mistake.of_neighbours ? Few(Without(data, mistake.undo)) : Without(few, mistake.undo),
            threads));
    all.back().mistake = &mistake;
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Tried& a, const Tried& b) { return ScoreOf(a) < ScoreOf(b); });
  if (!(all.front().residual_m < kNamed * before_m)) {
    if (const auto nearest_m = NearestOfAnyRow(data, aligned, before_m)) {
      return fmt::format(
          "{}, but only {:.2g} mm from where some other row puts the tip: measurements and joints "
          "are in different orders; put those of one moment into one row",
          found, 1e3 * *nearest_m);
    }
    return found +
           ": no effect but a wrong frame does that; check the DH table, units (mm, deg), the "
           "frame "
           "(is it \"unaligned\"?), that measurements and joints of one row belong together, and "
           "that cell and data do";
  }
  std::string text =
      fmt::format("{}; it falls to {:.2f} mm if {}: {}", found, 1e3 * all.front().residual_m,
                  SentenceOf(all.front()), all.front().mistake->remedy);
  for (std::size_t k = 1; k < std::min(kMostTold, all.size()); ++k) {
    if (ScoreOf(all[k]) > kAlso * ScoreOf(all.front())) break;
    text += fmt::format("; or, which these rows cannot tell from it, {}: {}", SentenceOf(all[k]),
                        all[k].mistake->remedy);
  }
  return text;
}

/// Robust sigma of the rows that a mistake concerns: of fewer than half of all rows, the middle of
/// all would not show it.
double SigmaOfConcerned(const Dataset& data, const Tried& tried, const Mistake& mistake) {
  if (!mistake.concerns || tried.residuals.empty()) return tried.sigma_m;
  FitRows rows;
  PerRow<RowResidual> residuals;
  for (const RowIndex row : data.row_indices()) {
    if (!mistake.concerns(data.measured(row))) continue;
    rows.push_back(row);
    residuals.push_back(tried.residuals[row]);
  }
  return RobustSigma(SelectRows(data, rows), residuals);
}

std::optional<std::string> NameSubtle(const Dataset& few, const std::vector<Mistake>& mistakes,
                                      double sigma_before_m, int threads) {
  const double noise_m = kNoise * few.sigma_m;
  const auto is_large = [&](double sigma_m) { return sigma_m >= kSubtleFall * few.sigma_m; };
  const bool of_a_part = std::any_of(mistakes.begin(), mistakes.end(), [](const Mistake& mistake) {
    return mistake.subtle && mistake.concerns;
  });
  if (few.sigma_m <= 0 || !(is_large(sigma_before_m) || of_a_part)) return std::nullopt;
  const Tried as_read = of_a_part ? Try(few, threads) : Tried{};
  for (const Mistake& mistake : mistakes) {
    if (!mistake.subtle) continue;
    const double before_m =
        mistake.concerns ? SigmaOfConcerned(few, as_read, mistake) : sigma_before_m;
    if (!is_large(before_m)) continue;
    const Tried tried = Try(Without(few, mistake.undo), threads);
    const double after_m = SigmaOfConcerned(few, tried, mistake);
    if (std::max(after_m, tried.sigma_m) > std::min(noise_m, before_m / kSubtleFall)) continue;
    const bool as_well = std::any_of(mistake.beside.begin(), mistake.beside.end(),
                                     [&](const std::function<void(Dataset&)>& undo) {
                                       return Try(Without(few, undo), threads).sigma_m < noise_m;
                                     });
    if (as_well) continue;
    return fmt::format(
        "what the declared cell leaves{} is {:.3g} mm on one axis; it falls to {:.3g} mm, the "
        "noise, "
        "if {}: {}",
        mistake.concerns ? " there" : "", 1e3 * before_m, 1e3 * after_m, mistake.sentence,
        mistake.remedy);
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> GrossError(const Dataset& data, const Linearisation& aligned,
                                      int threads) {
  const double before_m = MiddleResidual(aligned);
  if (SomeAreFar(aligned)) {
    if (const auto changed = ChangedUnit(data, threads)) return changed;
  }
  const std::vector<Mistake> mistakes = MistakesOf(data);
  if (before_m >= kGross_m) return NameGross(data, aligned, mistakes, before_m, threads);
  return NameSubtle(Few(data), mistakes, RobustSigma(data, ResidualsOf(aligned)), threads);
}

}  // namespace plumbline::diagnosis
