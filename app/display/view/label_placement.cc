#include "app/display/view/label_placement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace plumbline::display {
namespace {

constexpr int kDirections = 32;
constexpr float kDistances_em[] = {1.6F, 2.6F, 3.8F, 5.2F, 7.0F, 9.5F, 12.5F, 16.0F, 20.0F};
constexpr float kOwnMark_em = 1.3F;  ///< a leader line may start within the mark that it explains
/// Additional length [em] that is accepted to avoid crossing a label or another line.
constexpr float kLabelCrossed_em = 25;

bool Contains(const scene::Area& area, const scene::PicturePoint& p) {
  return p.x >= area.x && p.x < area.right() && p.y >= area.y && p.y < area.bottom();
}

/// Where a segment enters and leaves an area, as shares of its length.
struct Passage {
  float enter = 0, leave = 1;
};

/// @return  nullopt if they do not meet [Liang and Barsky, 1984]
std::optional<Passage> PassageOf(const LeaderLine& line, const scene::Area& area) {
  Passage passage;
  const auto clip = [&](float start, float delta, float low, float high) {
    if (delta == 0) return start >= low && start <= high;
    const float a = (low - start) / delta, b = (high - start) / delta;
    passage.enter = std::max(passage.enter, std::min(a, b));
    passage.leave = std::min(passage.leave, std::max(a, b));
    return passage.enter <= passage.leave;
  };
  const bool meets = clip(line.from.x, line.to.x - line.from.x, area.x, area.right()) &&
                     clip(line.from.y, line.to.y - line.from.y, area.y, area.bottom());
  return meets ? std::optional(passage) : std::nullopt;
}

bool Meets(const LeaderLine& line, const scene::Area& area) {
  return PassageOf(line, area).has_value();
}

/// Twice the signed area of the triangle a, b, c.
float Turn(const scene::PicturePoint& a, const scene::PicturePoint& b,
           const scene::PicturePoint& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool Meets(const LeaderLine& a, const LeaderLine& b) {
  return Turn(a.from, a.to, b.from) * Turn(a.from, a.to, b.to) < 0 &&
         Turn(b.from, b.to, a.from) * Turn(b.from, b.to, a.to) < 0;
}

/// Label whose edge is at the end of a leader line of this length and direction.
PlacedLabel LabelAt(const scene::PicturePoint& at, float width, float height, float distance,
                    double angle) {
  const auto c = static_cast<float>(std::cos(angle)), s = static_cast<float>(std::sin(angle));
  const scene::PicturePoint to{at.x + distance * c, at.y + distance * s};
  const bool beside = std::abs(c) > 0.5F;
  const float across = beside ? (c > 0 ? 0.0F : 1.0F) : (1 - c) / 2;
  const float along = beside ? (1 - s) / 2 : (s > 0 ? 0.0F : 1.0F);
  return {{to.x - across * width, to.y - along * height, width, height}, {at, to}};
}

}  // namespace

std::vector<LeaderLine> PartsOutside(const LeaderLine& line,
                                     const std::vector<PlacedLabel>& labels) {
  std::vector<LeaderLine> parts = {line};
  for (const PlacedLabel& label : labels) {
    std::vector<LeaderLine> outside;
    for (const LeaderLine& part : parts) {
      const auto passage = PassageOf(part, label.area);
      if (!passage) {
        outside.push_back(part);
        continue;
      }
      const auto at = [&](float share) {
        return scene::PicturePoint{part.from.x + share * (part.to.x - part.from.x),
                                   part.from.y + share * (part.to.y - part.from.y)};
      };
      if (passage->enter > 0) outside.push_back({part.from, at(passage->enter)});
      if (passage->leave < 1) outside.push_back({at(passage->leave), part.to});
    }
    parts = std::move(outside);
  }
  return parts;
}

float OverlapOf(const scene::Area& a, const scene::Area& b) {
  const float width = std::min(a.right(), b.right()) - std::max(a.x, b.x);
  const float height = std::min(a.bottom(), b.bottom()) - std::max(a.y, b.y);
  return width > 0 && height > 0 ? width * height : 0;
}

void LabelPlacer::KeepClear(const scene::Area& area) {
  const float step = em_ / 2;
  const float x = std::floor(area.x / step) * step, y = std::floor(area.y / step) * step;
  const float right = std::ceil(area.right() / step) * step;
  const float bottom = std::ceil(area.bottom() / step) * step;
  if (std::isfinite(x + y + right + bottom)) kept_clear_.push_back({x, y, right - x, bottom - y});
}

float LabelPlacer::CoveredBy(const scene::Area& area) const {
  float covered = 0;
  for (const scene::Area& one : kept_clear_) covered += OverlapOf(area, one);
  for (const scene::Area& one : taken_) covered += OverlapOf(area, one);
  return covered;
}

bool LabelPlacer::IsFree(const scene::Area& area) const {
  const bool inside = area.x >= image_.x && area.y >= image_.y && area.right() <= image_.right() &&
                      area.bottom() <= image_.bottom();
  return inside && CoveredBy(area) == 0 &&
         std::none_of(leaders_.begin(), leaders_.end(),
                      [&](const LeaderLine& one) { return Meets(one, area); });
}

bool LabelPlacer::CrossesMark(const LeaderLine& leader) const {
  const float dx = leader.to.x - leader.from.x, dy = leader.to.y - leader.from.y;
  const float own = std::min(1.0F, kOwnMark_em * em_ / std::hypot(dx, dy));
  const LeaderLine beyond{{leader.from.x + own * dx, leader.from.y + own * dy}, leader.to};
  return std::any_of(kept_clear_.begin(), kept_clear_.end(), [&](const scene::Area& one) {
    return !Contains(one, leader.from) && Meets(beyond, one);
  });
}

/// Cost of the labels and other lines that a leader line crosses [em].
float LabelPlacer::CrossingCost(const LeaderLine& leader) const {
  float cost = 0;
  for (const scene::Area& one : taken_) cost += Meets(leader, one) ? kLabelCrossed_em : 0;
  for (const LeaderLine& one : leaders_) cost += Meets(leader, one) ? kLabelCrossed_em : 0;
  return cost;
}

void LabelPlacer::Take(const PlacedLabel& label) {
  taken_.push_back(label.area);
  leaders_.push_back(label.leader);
}

std::optional<PlacedLabel> LabelPlacer::Place(const scene::PicturePoint& at, float width,
                                              float height) {
  if (!Contains(image_, at)) return std::nullopt;
  std::optional<PlacedLabel> best;
  float least = std::numeric_limits<float>::infinity();
  for (const float distance_em : kDistances_em) {
    if (distance_em >= least) break;
    for (int k = 0; k < kDirections; ++k) {
      // To the right first, then alternately down and up.
      const int turn = (k + 1) / 2 * (k % 2 == 0 ? 1 : -1);
      const PlacedLabel label =
          LabelAt(at, width, height, distance_em * em_, 2 * std::numbers::pi * turn / kDirections);
      if (!IsFree(label.area) || CrossesMark(label.leader)) continue;
      const float cost = distance_em + CrossingCost(label.leader);
      if (cost >= least) continue;
      least = cost;
      best = label;
    }
  }
  if (best) Take(*best);
  return best;
}

scene::Area LabelPlacer::InCorner(float width, float height, Corner corner) const {
  const float margin = 0.6F * em_;
  const bool right = corner == Corner::kTopRight || corner == Corner::kBottomRight;
  const bool bottom = corner == Corner::kBottomLeft || corner == Corner::kBottomRight;
  return {right ? image_.right() - margin - width : image_.x + margin,
          bottom ? image_.bottom() - margin - height : image_.y + margin, width, height};
}

std::optional<scene::Area> LabelPlacer::TakeFreeCorner(float width, float height,
                                                       const std::vector<Corner>& corners) {
  for (const Corner corner : corners) {
    const scene::Area area = InCorner(width, height, corner);
    if (CoveredBy(area) > 0) continue;
    taken_.push_back(area);
    return area;
  }
  return std::nullopt;
}

scene::Area LabelPlacer::TakeCorner(float width, float height, const std::vector<Corner>& corners) {
  if (const auto free = TakeFreeCorner(width, height, corners)) return *free;
  const auto covered = [&](Corner corner) { return CoveredBy(InCorner(width, height, corner)); };
  const Corner least = *std::min_element(
      corners.begin(), corners.end(), [&](Corner a, Corner b) { return covered(a) < covered(b); });
  taken_.push_back(InCorner(width, height, least));
  return taken_.back();
}

}  // namespace plumbline::display
