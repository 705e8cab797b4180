#include "app/diagnosis/empirical_bounds.h"

#include <algorithm>
#include <cmath>

#include "app/diagnosis/robust.h"
#include "firmware-like/effects/empirical.h"

namespace plumbline {
namespace {

/// What one carrier's curve does at the rows, in SI.
struct SeenCurve {
  double low = 1e300, high = -1e300;  ///< of the curve
  double largest_m = 0;               ///< displacement of the tip
  double lever_square = 0;            ///< sum over rows of |J|^2
  int rows = 0;
};

SeenCurve SeenAtRows(const Dataset& data, const Linearisation& linear,
                     const std::vector<double>& weights, const ActiveEffect& effect,
                     std::size_t carrier) {
  std::vector<double> values(effect.values.size(), 0.0);
  values[carrier] = 1;
  SeenCurve seen;
  for (std::size_t row = 0; row < linear.rows.size(); ++row) {
    if (weights[row] < kOutlierWeight) continue;
    Influence<double> influence;
    effect.term.effect->Add(effect.term, std::span<const double>(values), data.conditions[row],
                            influence);
    for (int entry = 0; entry < Influence<double>::kSize; ++entry) {
      if (influence[entry] == 0) continue;
      const double lever = linear.rows[row].dp.col(entry).norm();
      seen.low = std::min(seen.low, influence[entry]);
      seen.high = std::max(seen.high, influence[entry]);
      seen.largest_m = std::max(seen.largest_m, std::abs(influence[entry]) * lever);
      seen.lever_square += lever * lever;
      ++seen.rows;
    }
  }
  return seen;
}

}  // namespace

void BoundToRows(const Dataset& data, const Linearisation& linear,
                 const std::vector<double>& weights, ActiveEffect& effect) {
  if (effect.term.nodes.rows() == 0) return;
  for (std::size_t k = 0; k < effect.values.size(); ++k) {
    const SeenCurve seen = SeenAtRows(data, linear, weights, effect, k);
    auto nodes = effect.term.nodes.col(static_cast<Eigen::Index>(k) + 1);
    if (seen.rows == 0 || seen.lever_square == 0) {
      nodes.setZero();
      continue;
    }
    const double lever = std::sqrt(seen.lever_square / seen.rows);
    const double largest = seen.largest_m / lever;
    const double to_SI = EmpiricalNodeToSI(effect.term.parameters[k]);
    const double low = std::max(seen.low, -largest), high = std::min(seen.high, largest);
    nodes = nodes.cwiseMax(low / to_SI).cwiseMin(high / to_SI);
  }
}

}  // namespace plumbline
