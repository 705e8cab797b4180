#include "app/measure/diagnosis/empirical_bounds.h"

#include <algorithm>
#include <cmath>

#include "app/measure/diagnosis/robust.h"
#include "firmware-like/effects/empirical.h"

namespace plumbline::measure {
namespace {

/// Values and displacements of one carrier's curve at the accepted rows, SI.
struct CurveAtRows {
  struct Lever {
    double payload_kg = 0;
    double square = 0;  ///< |J|^2
  };
  double low = 1e300, high = -1e300;  ///< range of the curve
  double largest_m = 0;               ///< largest displacement of the tip
  std::vector<Lever> levers;          ///< of each row
};

CurveAtRows EvaluateAtRows(const FitProblem& problem, const Linearisation& linear,
                           const effects::ActiveEffect& effect, std::size_t carrier) {
  std::vector<double> values(effect.values.size(), 0.0);
  values[carrier] = 1;
  CurveAtRows seen;
  for (const RowIndex row : linear.rows.indices()) {
    if (problem.weights[row] < kOutlierWeight) continue;
    const effects::Conditions& moment = problem.data.conditions[row];
    effects::Influence<double> influence;
    effect.term.effect->Add(effect.term, std::span<const double>(values), moment, influence);
    for (int entry = 0; entry < effects::Influence<double>::kSize; ++entry) {
      if (influence[entry] == 0) continue;
      const double lever = LengthsOf(linear.gradients[row].col(entry)).norm();
      seen.low = std::min(seen.low, influence[entry]);
      seen.high = std::max(seen.high, influence[entry]);
      seen.largest_m = std::max(seen.largest_m, std::abs(influence[entry]) * lever);
      seen.levers.push_back({moment.payload_kg, lever * lever});
    }
  }
  return seen;
}

/// RMS lever arm of the rows with payloads from `low` to `high` [kg]; 0 if there are none.
double LeverBetween(const CurveAtRows& seen, double low, double high) {
  double sum = 0, count = 0;
  for (const CurveAtRows::Lever& lever : seen.levers) {
    if (lever.payload_kg < low || lever.payload_kg > high) continue;
    sum += lever.square;
    count += 1;
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

/// RMS lever arm by which a node moves the tip: over all rows, since any pose may occur at the
/// node's value; if the payload is a driver, over the rows with payloads near the node's.
double LeverOfNode(const CurveAtRows& seen, const effects::ActiveEffect& effect,
                   Eigen::Index node) {
  constexpr std::string_view kPayloadColumn = "payload_kg";
  const double of_all = LeverBetween(seen, -HUGE_VAL, HUGE_VAL);
  const auto& drivers = effect.term.drivers;
  const auto payload = std::ranges::find(drivers, kPayloadColumn);
  if (payload == drivers.end()) return of_all;
  const auto loads_kg = effect.term.nodes.col(payload - drivers.begin());
  double low = -HUGE_VAL, high = HUGE_VAL;  // of the neighbours
  for (const double load_kg : loads_kg) {
    if (load_kg < loads_kg[node]) low = std::max(low, load_kg);
    if (load_kg > loads_kg[node]) high = std::min(high, load_kg);
  }
  const double near_node = LeverBetween(seen, low, high);
  return near_node > 0 ? near_node : of_all;
}

}  // namespace

void BoundToRows(const FitProblem& problem, const Linearisation& linear,
                 effects::ActiveEffect& effect) {
  if (effect.term.nodes.rows() == 0) return;
  for (std::size_t k = 0; k < effect.values.size(); ++k) {
    const CurveAtRows seen = EvaluateAtRows(problem, linear, effect, k);
    auto nodes = effect.term.nodes.col(static_cast<Eigen::Index>(k + effect.term.drivers.size()));
    if (seen.largest_m == 0) {
      nodes.setZero();
      continue;
    }
    const double to_SI = effects::EmpiricalNodeToSI(effect.term.parameters[k]);
    for (Eigen::Index node = 0; node < nodes.size(); ++node) {
      const double largest = seen.largest_m / LeverOfNode(seen, effect, node);
      const double low = std::max(seen.low, -largest), high = std::min(seen.high, largest);
      nodes[node] = std::clamp(nodes[node], low / to_SI, std::max(low, high) / to_SI);
    }
  }
}

}  // namespace plumbline::measure
