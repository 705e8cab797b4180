#include "app/measure/diagnosis/linear/support_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace plumbline::measure {

SupportFit::SupportFit(const Eigen::MatrixXd& gram, const Eigen::VectorXd& moment, double chi2_null,
                       std::vector<Unit> units)
    : inverse_(Eigen::LLT<Eigen::MatrixXd>(gram).solve(
          Eigen::MatrixXd::Identity(gram.rows(), gram.cols()))),
      values_(inverse_ * moment),
      left_(moment.size()),
      at_(static_cast<std::size_t>(moment.size())),
      place_of_(at_.size()),
      minimum_(chi2_null - moment.dot(values_)),
      units_(std::move(units)) {
  std::iota(at_.begin(), at_.end(), 0);
  std::iota(place_of_.begin(), place_of_.end(), 0);
}

/// Rise of the minimum if a unit is dropped and the others are refitted: v^T (inverse block)^-1 v.
double SupportFit::RiseWithout(const Unit& unit) const {
  const auto at = [this, &unit](std::size_t k) { return at_[unit.places[k]]; };
  const std::size_t n = unit.places.size();
  if (n == 1) return values_[at(0)] * values_[at(0)] / inverse_(at(0), at(0));
  const auto solved = [&](auto part, auto value) {
    for (std::size_t i = 0; i < n; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      value[row] = values_[at(i)];
      for (std::size_t j = 0; j < n; ++j) {
        part(row, static_cast<Eigen::Index>(j)) = inverse_(at(i), at(j));
      }
    }
    return value.dot(part.ldlt().solve(value));
  };
  const auto size = static_cast<Eigen::Index>(n);
  // Units of up to six columns (a vector or a frame) need no heap allocation; curves do.
  constexpr int kFew = 6;
  if (size <= kFew) {
    using Few = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kFew, kFew>;
    using FewValues = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kFew, 1>;
    return solved(Few(size, size), FewValues(size));
  }
  return solved(Eigen::MatrixXd(size, size), Eigen::VectorXd(size));
}

void SupportFit::Drop(int place) {
  const Eigen::Index last = left_ - 1, at = at_[place];
  if (at != last) {
    inverse_.row(at).head(left_).swap(inverse_.row(last).head(left_));
    inverse_.col(at).head(left_).swap(inverse_.col(last).head(left_));
    std::swap(values_[at], values_[last]);
    const int moved = place_of_[last];
    place_of_[at] = moved;
    place_of_[last] = place;
    at_[moved] = static_cast<int>(at);
    at_[place] = static_cast<int>(last);
  }
  const double pivot = inverse_(last, last);
  const auto column = inverse_.col(last).head(last);
  values_.head(last) -= column * (values_[last] / pivot);
  inverse_.topLeftCorner(last, last).noalias() -= column * (column.transpose() / pivot);
  left_ = last;
}

void SupportFit::Eliminate() {
  while (true) {
    double most = 0, rise_of_worst = 0;
    auto worst = units_.end();
    for (auto unit = units_.begin(); unit != units_.end(); ++unit) {
      const double rise = RiseWithout(*unit);
      const double gain = unit->cost - rise;
      if (gain <= most) continue;
      most = gain;
      rise_of_worst = rise;
      worst = unit;
    }
    if (worst == units_.end()) return;
    Drop(worst, rise_of_worst);
  }
}

bool SupportFit::DropOutOfBounds(const std::vector<model::Interval>& bounds) {
  double least = HUGE_VAL;
  auto cheapest = units_.end();
  for (auto unit = units_.begin(); unit != units_.end(); ++unit) {
    const bool within = std::ranges::all_of(
        unit->places, [&](int place) { return bounds[place].Contains(Value(place)); });
    if (within) continue;
    const double rise = RiseWithout(*unit);
    if (rise >= least) continue;
    least = rise;
    cheapest = unit;
  }
  if (cheapest == units_.end()) return false;
  Drop(cheapest, least);
  return true;
}

void SupportFit::Drop(Units::iterator unit, double rise) {
  minimum_ += rise;
  for (const int place : unit->places) Drop(place);
  units_.erase(unit);
}

std::vector<int> SupportFit::Places() const {
  std::vector<int> places;
  for (const Unit& unit : units_) {
    places.insert(places.end(), unit.places.begin(), unit.places.end());
  }
  std::ranges::sort(places);
  return places;
}

}  // namespace plumbline::measure
