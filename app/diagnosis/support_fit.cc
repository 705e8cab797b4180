#include "app/diagnosis/support_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace plumbline {

SupportFit::SupportFit(const Eigen::MatrixXd& gram, const Eigen::VectorXd& moment, double chi2_null,
                       std::vector<Unit> units)
    : inverse_(Eigen::LLT<Eigen::MatrixXd>(gram).solve(
          Eigen::MatrixXd::Identity(gram.rows(), gram.cols()))),
      values_(inverse_ * moment),
      chi2_(chi2_null - moment.dot(values_)),
      units_(std::move(units)) {}

/// The rise of chi2 when a unit goes, the others refitted: v^T (inverse part)^-1 v.
double SupportFit::RiseWithout(const Unit& unit) const {
  if (unit.places.size() == 1) {
    const int i = unit.places.front();
    return values_[i] * values_[i] / inverse_(i, i);
  }
  const Eigen::MatrixXd part = inverse_(unit.places, unit.places);
  const Eigen::VectorXd value = values_(unit.places);
  return value.dot(part.ldlt().solve(value));
}

void SupportFit::Drop(const Unit& unit) {
  for (const int place : unit.places) {
    const Eigen::VectorXd column = inverse_.col(place);
    values_ -= column * (values_[place] / column[place]);
    inverse_.noalias() -= column * (column.transpose() / column[place]);
    values_[place] = 0;
  }
}

void SupportFit::Eliminate(const std::function<double(const Unit&)>& cost) {
  while (true) {
    double most = 0, rise_of_worst = 0;
    auto worst = units_.end();
    for (auto unit = units_.begin(); unit != units_.end(); ++unit) {
      const double rise = RiseWithout(*unit);
      const double gain = cost(*unit) - rise;
      if (gain <= most) continue;
      most = gain;
      rise_of_worst = rise;
      worst = unit;
    }
    if (worst == units_.end()) return;
    chi2_ += rise_of_worst;
    Drop(*worst);
    units_.erase(worst);
  }
}

std::vector<int> SupportFit::Places() const {
  std::vector<int> places;
  for (const Unit& unit : units_) {
    places.insert(places.end(), unit.places.begin(), unit.places.end());
  }
  std::sort(places.begin(), places.end());
  return places;
}

}  // namespace plumbline
