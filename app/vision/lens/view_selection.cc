#include "app/vision/lens/view_selection.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/vision/lens/board_orders.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::vision {
namespace {

constexpr std::size_t kMinViews = 6;
constexpr int kCellColumns = 6, kCellRows = 4;
constexpr double kMaxBlurRatio = 2.5;  // times the median edge width

std::string TooFewViews(std::size_t usable, const std::vector<RefusedFrame>& refused) {
  std::string reason = fmt::format(
      "the board was found in {} usable frames; at least {} are "
      "needed: hold the whole board in the image, well lit and still",
      usable, kMinViews);
  const auto wrong = std::ranges::count_if(
      refused, [](const RefusedFrame& frame) { return frame.reason == kDoesNotFit; });
  if (wrong > 0) {
    reason += fmt::format(
        "; {} further frames do not fit the others, as if the board was detected wrongly", wrong);
  }
  return reason;
}

}  // namespace

std::vector<BoardView> RemoveBlurred(std::span<const BoardView> views,
                                     std::vector<RefusedFrame>& refused) {
  std::vector<double> widths;
  for (const BoardView& view : views) widths.push_back(view.blur_px);
  std::vector<BoardView> sharp;
  if (widths.empty()) return sharp;
  const double limit = std::max(kMaxBlurRatio * statistics::MedianOf(widths), 1.5);
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

void RemoveViews(const std::vector<std::size_t>& indices, const std::string& why,
                 std::vector<BoardView>& views, std::vector<RefusedFrame>& refused) {
  std::vector<BoardView> remaining;
  for (std::size_t j = 0; j < views.size(); ++j) {
    if (std::binary_search(indices.begin(), indices.end(), j)) {
      refused.push_back({views[j].name, why});
    } else {
      remaining.push_back(std::move(views[j]));
    }
  }
  views = std::move(remaining);
}

double Coverage(std::span<const BoardView> views, image::ImageSize size) {
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
  return static_cast<double>(std::ranges::count(cells, true)) / static_cast<double>(cells.size());
}

double SharedVariance(const LensFit& fit) {
  const std::size_t corners = fit.residuals_px[0].size();
  double sum = 0;
  int count = 0;
  for (std::size_t k = 0; k < corners; ++k) {
    lens::Vec2 mean = lens::Vec2::Zero();
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

Result<ConsistentFit> FitConsistentViews(const target::Board& board, image::ImageSize size,
                                         std::vector<BoardView>& kept,
                                         std::vector<RefusedFrame>& refused) {
  while (kept.size() >= kMinViews) {
    Result<LensFit> fit = FitLens(board, kept, size);
    if (!fit) return Error{fit.error()};
    ViewConsistency consistency = ConsistencyOf(board, *fit, kept);
    if (RenumberToOneOrder(board, size, *fit, consistency, kept)) {
      fit = FitLens(board, kept, size);
      if (!fit) return Error{fit.error()};
      consistency = ConsistencyOf(board, *fit, kept);
    }
    if (consistency.wrong.empty())
      return ConsistentFit{std::move(fit.value()), std::move(consistency)};
    RemoveViews(consistency.wrong, kDoesNotFit, kept, refused);
  }
  return Error{TooFewViews(kept.size(), refused)};
}

std::vector<std::string> UnusedAtTheEnd(std::span<const BoardView> views,
                                        std::span<const BoardView> kept) {
  std::vector<std::string> names;
  for (auto view = views.rbegin(); view != views.rend(); ++view) {
    const bool used = std::ranges::any_of(kept, [&](const BoardView& other) {
      return other.name == view->name && other.time_s == view->time_s;
    });
    if (used) break;
    names.insert(names.begin(), view->name);
  }
  return names;
}

}  // namespace plumbline::vision
