#include "app/lens/calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/lens/standstill.h"
#include "firmware-like/statistics/median.h"

namespace plumbline {
namespace {

constexpr std::size_t kLeastViews = 6;
// Of views without any change, for each of three kinds of change. 5 % may be refused in all; at
// this level one simulated capture in a hundred was.
constexpr double kChanceOfChange = 1e-2;
constexpr double kAlsoExplains = 1.0 / 3;  // of the likeliest change's chi^2: named as well
constexpr double kLeastCoverage = 0.35;
constexpr int kCellColumns = 6, kCellRows = 4;
constexpr double kLeastTilt_rad = 0.15;  // spread of the board's normals
constexpr double kFarEnough = 0.9;       // of the way to the image's corner; for the words alone
constexpr double kBlurred = 2.5;         // times the middle width of the edges
constexpr double kMisfit = 3;            // times the middle RMS of the views
constexpr double kUnevenBoard = 0.4;     // share of a view's variance that all views share

/// Takes the views out that are far more blurred than the others.
std::vector<BoardView> Sharp(std::span<const BoardView> views, std::vector<RefusedFrame>& refused) {
  std::vector<double> widths;
  for (const BoardView& view : views) widths.push_back(view.blur_px);
  std::vector<BoardView> sharp;
  if (widths.empty()) return sharp;
  const double limit = std::max(kBlurred * MedianOf(widths), 1.5);
  for (const BoardView& view : views) {
    if (view.blur_px > limit) {
      refused.push_back(
          {view.name,
           fmt::format("blurred: edges {:.1f} px wide; hold the board still", view.blur_px)});
    } else {
      sharp.push_back(view);
    }
  }
  return sharp;
}

/// Takes the views out that the fit does not reach. @return whether there were any
bool TakeMisfitsOut(const LensFit& fit, std::vector<BoardView>& views,
                    std::vector<RefusedFrame>& refused) {
  std::vector<double> sizes = fit.view_rms_px;
  const double limit = kMisfit * std::max(MedianOf(sizes), 0.01);
  std::vector<BoardView> fitting;
  for (std::size_t j = 0; j < views.size(); ++j) {
    const auto seen = std::count(views[j].seen.begin(), views[j].seen.end(), true);
    const auto used = std::count(fit.used[j].begin(), fit.used[j].end(), true);
    if (fit.view_rms_px[j] > limit || 2 * used < seen) {
      refused.push_back({views[j].name, "does not fit the other views: moved, or found wrongly"});
    } else {
      fitting.push_back(views[j]);
    }
  }
  const bool any = fitting.size() < views.size();
  views = fitting;
  return any;
}

double Coverage(std::span<const BoardView> views, ImageSize size) {
  std::vector<bool> cells(std::size_t{kCellColumns} * kCellRows, false);
  for (const BoardView& view : views) {
    for (std::size_t k = 0; k < view.corners_px.size(); ++k) {
      if (!view.seen[k]) continue;
      const int column = static_cast<int>(view.corners_px[k].x() * kCellColumns / size.width);
      const int row = static_cast<int>(view.corners_px[k].y() * kCellRows / size.height);
      cells[std::clamp(row, 0, kCellRows - 1) * kCellColumns +
            std::clamp(column, 0, kCellColumns - 1)] = true;
    }
  }
  return static_cast<double>(std::count(cells.begin(), cells.end(), true)) /
         static_cast<double>(cells.size());
}

/// Variance of a corner's coordinate that all views share: the print's own errors and what is left
/// of the board's shape.
double SharedVariance(const LensFit& fit) {
  const std::size_t corners = fit.residuals_px[0].size();
  double sum = 0;
  int count = 0;
  for (std::size_t k = 0; k < corners; ++k) {
    Vec2 mean = Vec2::Zero();
    int views = 0;
    for (std::size_t j = 0; j < fit.residuals_px.size(); ++j) {
      if (!fit.used[j][k]) continue;
      mean += fit.residuals_px[j][k];
      ++views;
    }
    if (views < 2) continue;
    sum += 0.5 * (mean / views).squaredNorm() - fit.sigma_px * fit.sigma_px / views;
    ++count;
  }
  return count > 0 ? std::max(0.0, sum / count) : 0;
}

double TiltSpread(const LensFit& fit) {
  double widest = 0;
  for (const Pose& a : fit.X_CK) {
    for (const Pose& b : fit.X_CK)
      widest = std::max(widest, std::acos(std::clamp(a.R.col(2).dot(b.R.col(2)), -1.0, 1.0)));
  }
  return widest;
}

/// From the image's middle to the farthest corner that was used, share of the way to the image's
/// corner.
double Reach(const LensFit& fit, std::span<const BoardView> views, ImageSize size) {
  const Vec2 middle(0.5 * (size.width - 1), 0.5 * (size.height - 1));
  double farthest = 0;
  for (std::size_t j = 0; j < views.size(); ++j) {
    for (std::size_t k = 0; k < views[j].corners_px.size(); ++k) {
      if (fit.used[j][k]) farthest = std::max(farthest, (views[j].corners_px[k] - middle).norm());
    }
  }
  return farthest / middle.norm();
}

/// Difference of the highest and the lowest place of the board over its plane [m].
/// @param bow  kBowX, kBowY, kBowXY
double LargestBow(const Vec3& bow, const Board& board) {
  double lowest = 0, highest = 0;
  for (int k = 0; k < board.corners(); ++k) {
    const Vec2 at = board.Corner(k) - board.Centre();
    const double z =
        bow.x() * at.x() * at.x() + bow.y() * at.y() * at.y() + bow.z() * at.x() * at.y();
    lowest = std::min(lowest, z);
    highest = std::max(highest, z);
  }
  return highest - lowest;
}

/// "the focal length changed by 0.21 % between view 4 and view 5"
std::string InWords(const Change& change, const LensFit& fit, std::span<const BoardView> views,
                    const Board& board) {
  const std::string when =
      change.steady
          ? "from the first to the last"
          : fmt::format("between {} and {}", views[change.at - 1].name, views[change.at].name);
  switch (change.of) {
    case Change::Of::kFocalLength:
      return fmt::format("the focal length changed by {:.2f} % {}",
                         100 * change.by[kFx] / fit.shared[kFx], when);
    case Change::Of::kCentre:
      return fmt::format("the principal point moved by {:.1f} px {}",
                         std::hypot(change.by[kCx], change.by[kCy]), when);
    case Change::Of::kBoard:
      break;
  }
  return fmt::format("the board bent by {:.2f} mm {}",
                     1e3 * LargestBow(change.by.segment<3>(kBowX), board), when);
}

/// A change of lens or board refuses the answer; one that cannot be told widens its covariance.
void JudgeStandstill(const LensFit& fit, std::span<const BoardView> views, double widening,
                     LensCalibration& answer) {
  Standstill standstill = StandstillOf(fit, views, widening);
  answer.covariance += standstill.doubt;
  auto& changes = standstill.changes;
  std::sort(changes.begin(), changes.end(),
            [](const Change& a, const Change& b) { return a.chi2 > b.chi2; });
  std::string words;
  bool lens_moved = false;
  for (const Change& change : changes) {
    if (change.chance > kChanceOfChange || change.chi2 < kAlsoExplains * changes[0].chi2) continue;
    if (!words.empty()) words += ", or ";
    words += InWords(change, fit, views, answer.board);
    lens_moved |= change.of != Change::Of::kBoard;
  }
  if (words.empty()) return;
  answer.reasons.push_back(
      fmt::format("the {} moved while the frames were taken: {}; let the zoom come to rest, fasten "
                  "camera, lens "
                  "and board, then take them anew",
                  lens_moved ? "lens" : "board", words));
}

void JudgeUncertainty(const LensFit& fit, std::span<const BoardView> views,
                      const CalibrationOptions& options, LensCalibration& answer) {
  answer.uncertainty =
      UncertaintyOf(answer.lens, answer.covariance, answer.size, options.distance_m);
  if (answer.uncertainty.max_px <= options.acceptable_px) return;
  std::string reason = fmt::format(
      "the projection is uncertain by {:.2g} px at the worst place of the image; {:.2g} px is "
      "allowed: ",
      answer.uncertainty.max_px, options.acceptable_px);
  const double reach = Reach(fit, views, answer.size);
  if (TiltSpread(fit) < kLeastTilt_rad) {
    reason +=
        "the views are too much alike; tilt the board by 20 to 40 degrees, to the left, to the "
        "right, up and down";
  } else if (reach < kFarEnough) {
    reason += fmt::format(
        "the board was seen only as far as {:.0f} % of the way from the middle to the corners of "
        "the image, and what the lens does beyond is a guess; hold it into the corners",
        100 * reach);
  } else {
    reason += "take further views, tilted and close to the corners of the image";
  }
  answer.reasons.push_back(std::move(reason));
}

}  // namespace

LensCalibration CalibrateLens(const Board& board, std::span<const BoardView> views, ImageSize size,
                              const CalibrationOptions& options) {
  LensCalibration answer;
  answer.size = size;
  answer.board = board;
  std::vector<BoardView> kept = Sharp(views, answer.frames_refused);
  std::optional<LensFit> fit;
  for (int round = 0; round < 3; ++round) {
    if (kept.size() < kLeastViews) break;
    const Result<LensFit> fitted = FitLens(board, kept, size);
    if (!fitted) {
      answer.reasons.push_back(fitted.error());
      answer.further_views_help = true;
      return answer;
    }
    fit = *fitted;
    if (!TakeMisfitsOut(*fit, kept, answer.frames_refused)) break;
    fit.reset();
  }
  if (!fit) {
    answer.reasons.push_back(fmt::format(
        "the board was found in {} usable frames; at least {} are needed: hold the whole "
        "board into the image, well lit and still",
        kept.size(), kLeastViews));
    answer.further_views_help = true;
    return answer;
  }
  for (const BoardView& view : kept) answer.frames_used.push_back(view.name);
  answer.lens = LensOfShared(fit->shared);
  answer.rms_px = fit->rms_px;
  answer.sigma_px = fit->sigma_px;
  answer.board_bow_m = LargestBow(fit->shared.segment<3>(kBowX), board);
  answer.coverage = Coverage(kept, size);
  const double shared = SharedVariance(*fit) / (fit->sigma_px * fit->sigma_px);
  const double widening =
      std::max({1.0, fit->dispersion, 1 + static_cast<double>(kept.size()) * shared});
  answer.covariance = widening * fit->covariance.topLeftCorner<kLensCount, kLensCount>();
  JudgeStandstill(*fit, kept, widening, answer);
  std::size_t mendable = answer.reasons.size();
  JudgeUncertainty(*fit, kept, options, answer);
  mendable = answer.reasons.size() - mendable;
  if (shared > kUnevenBoard) {
    answer.reasons.push_back(fmt::format(
        "the board is not what it should be: {:.0f} % of the corners' error is the same in all "
        "views; use a board that is flat and printed true to size",
        100 * shared));
  }
  if (answer.coverage < kLeastCoverage) {
    answer.reasons.push_back(
        fmt::format("the corners cover only {:.0f} % of the image; hold the board nearer, and into "
                    "the corners of the image",
                    100 * answer.coverage));
    ++mendable;
  }
  answer.further_views_help = mendable > 0 && mendable == answer.reasons.size();
  answer.accepted = answer.reasons.empty();
  return answer;
}

}  // namespace plumbline
