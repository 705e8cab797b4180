#include "app/diagnosis/empirical_bounds.h"

#include <algorithm>
#include <cmath>

#include "app/diagnosis/robust.h"
#include "firmware-like/effects/empirical.h"

namespace plumbline {
namespace {

/// What one carrier's curve does at the rows, in SI.
struct SeenCurve {
  struct Lever {
    double driver = 0;  ///< value of the curve's driver at the row
    double square = 0;  ///< |J|^2
  };
  double low = 1e300, high = -1e300;  ///< of the curve
  double largest_m = 0;               ///< displacement of the tip
  std::vector<Lever> levers;          ///< of each row
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
      const auto driver = data.conditions[row].Signal(effect.term.drivers.front());
      seen.levers.push_back({driver.value_or(0), lever * lever});
    }
  }
  return seen;
}

/// RMS lever of the rows whose driver lies from `low` to `high`; 0 where there are none.
double LeverBetween(const SeenCurve& seen, double low, double high) {
  double sum = 0, count = 0;
  for (const SeenCurve::Lever& lever : seen.levers) {
    if (lever.driver < low || lever.driver > high) continue;
    sum += lever.square;
    count += 1;
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

/// The lever by which a node moves the tip: that of all rows, since any of them may meet the node's
/// value; where the payload drives the curve, that of the rows about the node, since no other
/// payload meets it.
double LeverOfNode(const SeenCurve& seen, const ActiveEffect& effect, Eigen::Index node) {
  constexpr std::string_view kPayloadColumn = "payload_kg";
  const double of_all = LeverBetween(seen, -HUGE_VAL, HUGE_VAL);
  if (effect.term.drivers.front() != kPayloadColumn) return of_all;
  const auto drivers = effect.term.nodes.col(0);
  const double low = node > 0 ? drivers[node - 1] : -HUGE_VAL;
  const double high = node + 1 < drivers.size() ? drivers[node + 1] : HUGE_VAL;
  const double about = LeverBetween(seen, low, high);
  return about > 0 ? about : of_all;
}

}  // namespace

void BoundToRows(const Dataset& data, const Linearisation& linear,
                 const std::vector<double>& weights, ActiveEffect& effect) {
  if (effect.term.nodes.rows() == 0) return;
  for (std::size_t k = 0; k < effect.values.size(); ++k) {
    const SeenCurve seen = SeenAtRows(data, linear, weights, effect, k);
    auto nodes = effect.term.nodes.col(static_cast<Eigen::Index>(k) + 1);
    if (seen.largest_m == 0) {
      nodes.setZero();
      continue;
    }
    const double to_SI = EmpiricalNodeToSI(effect.term.parameters[k]);
    for (Eigen::Index node = 0; node < nodes.size(); ++node) {
      const double largest = seen.largest_m / LeverOfNode(seen, effect, node);
      const double low = std::max(seen.low, -largest), high = std::min(seen.high, largest);
      nodes[node] = std::clamp(nodes[node], low / to_SI, std::max(low, high) / to_SI);
    }
  }
}

}  // namespace plumbline
