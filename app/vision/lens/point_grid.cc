#include "app/vision/lens/point_grid.h"

#include <algorithm>

namespace plumbline::vision {

PointGrid::PointGrid(std::vector<lens::Vec2> points, double size)
    : points_(std::move(points)), size_(size) {
  lens::Vec2 extent = lens::Vec2::Ones();
  for (const lens::Vec2& point : points_) extent = extent.cwiseMax(point);
  columns_ = static_cast<int>(extent.x() / size_) + 1;
  rows_ = static_cast<int>(extent.y() / size_) + 1;
  cells_.resize(static_cast<std::size_t>(columns_) * rows_);
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const int row = CellOf(points_[k].y(), rows_), column = CellOf(points_[k].x(), columns_);
    cells_[row * columns_ + column].push_back(static_cast<int>(k));
  }
}

int PointGrid::CellOf(double at, int count) const {
  return std::clamp(static_cast<int>(at / size_), 0, count - 1);
}

template <typename Each>
void PointGrid::Around(const lens::Vec2& at, double reach, const Each& each) const {
  const int last_row = CellOf(at.y() + reach, rows_), last = CellOf(at.x() + reach, columns_);
  for (int row = CellOf(at.y() - reach, rows_); row <= last_row; ++row) {
    for (int column = CellOf(at.x() - reach, columns_); column <= last; ++column) {
      for (const int point : cells_[row * columns_ + column]) each(point);
    }
  }
}

std::vector<int> PointGrid::Nearest(int of, std::size_t count,
                                    std::initializer_list<int> reaches) const {
  std::vector<std::pair<double, int>> near;
  for (const int reach : reaches) {
    near.clear();
    Around(points_[of], reach * size_, [&](int other) {
      if (other != of) near.emplace_back((points_[other] - points_[of]).squaredNorm(), other);
    });
    if (near.size() >= count) break;
  }
  const std::size_t found = std::min(count, near.size());
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(found), near.end());
  std::vector<int> nearest;
  for (std::size_t k = 0; k < found; ++k) nearest.push_back(near[k].second);
  return nearest;
}

int PointGrid::At(const lens::Vec2& position, double within) const {
  int nearest = -1;
  double least = within * within;
  Around(position, within, [&](int point) {
    const double distance = (points_[point] - position).squaredNorm();
    if (distance >= least) return;
    least = distance;
    nearest = point;
  });
  return nearest;
}

}  // namespace plumbline::vision
