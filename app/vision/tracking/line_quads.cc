#include "app/vision/tracking/line_quads.h"

#include <algorithm>
#include <cmath>

namespace plumbline::vision {
namespace {

constexpr std::size_t kMaxSegments = 2000;  // the longest ones
constexpr std::size_t kMaxSuccessors = 6;   // of a line, with the smallest gaps
constexpr double kMinTurn = 0.26;           // sine of the angle at a corner
constexpr double kMaxGap = 1.0;             // hidden part at a corner, of the line's length
constexpr double kMinGap_px = 3;            // allowed in any case
constexpr double kOverlap_px = 2.5;         // of a segment beyond the corner
constexpr double kMinVisible = 0.3, kMinVisibleInAll = 0.5;  // share of a side, of the outline
constexpr double kMinSide_px = 5;                            // of the search image
constexpr double kJoinMiss_px = 1.2, kJoinCos = 0.995;
constexpr double kMaxJoinGap = 1.0;    // of the lengths of both segments
constexpr double kMaxJoinReach = 3.0;  // of the first one's

double Cross(const lens::Vec2& a, const lens::Vec2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

double GapAllowed(const EdgeSegment& line) {
  return std::max(kMinGap_px, kMaxGap * line.length);
}

bool ByStart(const EdgeSegment& a, const EdgeSegment& b) {
  return a.start.x() != b.start.x() ? a.start.x() < b.start.x() : a.start.y() < b.start.y();
}

}  // namespace

void LineQuads::SelectLines(const std::vector<EdgeSegment>& segments) {
  lines_.assign(segments.begin(), segments.end());
  if (lines_.size() > kMaxSegments) {
    std::nth_element(lines_.begin(), lines_.begin() + kMaxSegments, lines_.end(),
                     [](const EdgeSegment& a, const EdgeSegment& b) {
                       return a.length != b.length ? a.length > b.length : ByStart(a, b);
                     });
    lines_.resize(kMaxSegments);
  }
  std::ranges::sort(lines_, ByStart);
}

/// Adds the line from the start of each segment to the end of the nearest collinear one after it.
void LineQuads::Join() {
  const std::size_t count = lines_.size();
  for (std::size_t i = 0; i < count; ++i) {
    const EdgeSegment a = lines_[i];
    const double reach = kMaxJoinReach * a.length;
    const auto end = lines_.begin() + static_cast<std::ptrdiff_t>(count);
    auto j = std::lower_bound(lines_.begin(), end, a.end.x() - reach,
                              [](const EdgeSegment& l, double x) { return l.start.x() < x; });
    double least_gap = reach;
    const EdgeSegment* nearest = nullptr;
    for (; j != end && j->start.x() <= a.end.x() + reach; ++j) {
      const lens::Vec2 between = j->start - a.end;
      const double gap = a.direction.dot(between);
      if (gap < -kOverlap_px || gap >= least_gap || gap > kMaxJoinGap * (a.length + j->length) ||
          a.direction.dot(j->direction) < kJoinCos ||
          std::abs(Cross(a.direction, between)) > kJoinMiss_px) {
        continue;
      }
      const lens::Vec2 direction = (j->end - a.start).normalized();
      if (std::abs(Cross(direction, a.end - a.start)) > kJoinMiss_px ||
          std::abs(Cross(direction, j->start - a.start)) > kJoinMiss_px) {
        continue;
      }
      least_gap = gap;
      nearest = &*j;
    }
    if (nearest == nullptr) continue;
    const lens::Vec2 whole = nearest->end - a.start;
    const double length = whole.norm();
    const EdgeSegment joined{a.start, nearest->end, whole / length, length};
    lines_.push_back(joined);
  }
  std::ranges::sort(lines_, ByStart);
}

void LineQuads::FindSuccessors() {
  successors_.clear();
  successors_start_.clear();
  for (const EdgeSegment& a : lines_) {
    successors_start_.push_back(static_cast<int>(successors_.size()));
    candidates_.clear();
    const double gap_a = GapAllowed(a), reach = 2.5 * gap_a;
    auto j = std::lower_bound(lines_.begin(), lines_.end(), a.end.x() - reach,
                              [](const EdgeSegment& l, double x) { return l.start.x() < x; });
    for (; j != lines_.end() && j->start.x() <= a.end.x() + reach; ++j) {
      const EdgeSegment& b = *j;
      const double turn = Cross(a.direction, b.direction);
      if (turn < kMinTurn) continue;
      const lens::Vec2 between = b.start - a.end;
      const double after_a = Cross(between, b.direction) / turn;
      if (after_a < -kOverlap_px || after_a > gap_a) continue;
      const double before_b = Cross(a.direction, between) / turn;
      if (before_b < -kOverlap_px || before_b > GapAllowed(b)) continue;
      candidates_.push_back({static_cast<int>(j - lines_.begin()),
                             static_cast<float>(std::abs(after_a) + std::abs(before_b)),
                             a.end + after_a * a.direction});
    }
    const auto closer = [](const Successor& l, const Successor& r) {
      return l.gap != r.gap ? l.gap < r.gap : l.line < r.line;
    };
    if (candidates_.size() > kMaxSuccessors) {
      std::nth_element(candidates_.begin(), candidates_.begin() + kMaxSuccessors, candidates_.end(),
                       closer);
      candidates_.resize(kMaxSuccessors);
    }
    successors_.insert(successors_.end(), candidates_.begin(), candidates_.end());
  }
  successors_start_.push_back(static_cast<int>(successors_.size()));
}

/// Appends the quadrilaterals whose line of the smallest index is `first`.
void LineQuads::Close(int first, const SearchImage& search, std::vector<Corners>& quads) const {
  const auto successors = [&](int line) {
    return std::pair{successors_.begin() + successors_start_[line],
                     successors_.begin() + successors_start_[line + 1]};
  };
  /// The share of a side that its line shows; 0 if it runs the other way.
  const auto shown = [&](int line, const lens::Vec2& from, const lens::Vec2& to) {
    const EdgeSegment& l = lines_[line];
    const double side = l.direction.dot(to - from);
    return side < kMinSide_px ? 0.0 : std::min(1.0, l.length / side);
  };
  const auto [begin1, end1] = successors(first);
  for (auto s1 = begin1; s1 != end1; ++s1) {
    if (s1->line <= first) continue;
    const auto [begin2, end2] = successors(s1->line);
    for (auto s2 = begin2; s2 != end2; ++s2) {
      if (s2->line <= first || shown(s1->line, s1->corner, s2->corner) < kMinVisible) continue;
      const auto [begin3, end3] = successors(s2->line);
      for (auto s3 = begin3; s3 != end3; ++s3) {
        if (s3->line <= first || s3->line == s1->line ||
            shown(s2->line, s2->corner, s3->corner) < kMinVisible) {
          continue;
        }
        const auto [begin4, end4] = successors(s3->line);
        for (auto s4 = begin4; s4 != end4; ++s4) {
          if (s4->line != first) continue;
          const double c = shown(s3->line, s3->corner, s4->corner);
          const double d = shown(first, s4->corner, s1->corner);
          if (std::min(c, d) < kMinVisible) continue;
          const Corners at{s4->corner, s1->corner, s2->corner, s3->corner};
          Corners quad;
          double outline = 0, visible = 0;
          const int line[4] = {first, s1->line, s2->line, s3->line};
          for (int k = 0; k < 4; ++k) {
            const double side = (at[(k + 1) % 4] - at[k]).norm();
            outline += side;
            visible += std::min(side, lines_[line[k]].length);
            quad[k] = search.ImagePixel(at[k].x(), at[k].y());
          }
          if (visible >= kMinVisibleInAll * outline) quads.push_back(quad);
        }
      }
    }
  }
}

void LineQuads::Find(const SearchImage& search, const std::vector<EdgeSegment>& segments,
                     std::vector<Corners>& quads) {
  SelectLines(segments);
  Join();
  FindSuccessors();
  for (int line = 0; line < static_cast<int>(lines_.size()); ++line) Close(line, search, quads);
}

}  // namespace plumbline::vision
