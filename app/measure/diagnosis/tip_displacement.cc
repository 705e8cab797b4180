#include "app/measure/diagnosis/tip_displacement.h"

#include <cmath>
#include <optional>

#include "app/measure/diagnosis/thresholds.h"

namespace plumbline::measure {
namespace {

constexpr int kMostRows = 500;

bool IsSize(const effects::EffectTerm& term, std::size_t value) {
  const auto spec = static_cast<std::size_t>(term.parameters[value].spec);
  return term.effect->traits().parameters[spec].role == effects::ParameterRole::kSize;
}

}  // namespace

TipDisplacement TipDisplacementOf(const FitProblem& problem, const effects::ActiveEffect& effect) {
  const Dataset& data = problem.data;
  const deflection::LoadedArm arm(data.cell);
  const std::size_t values = effect.values.size();
  std::vector<effects::ActiveEffect> alone(values, effect);
  for (std::size_t k = 0; k < values; ++k) {
    for (std::size_t other = 0; other < values; ++other) {
      if (other != k && IsSize(effect.term, other)) alone[k].values[other] = 0;
    }
  }
  double all = 0;
  std::vector<double> each(values, 0.0);
  int used = 0;
  deflection::LoadedState state;
  for (const RowIndex row : EvenlySpacedRows(data, kMostRows)) {
    if (problem.weights[row] < kOutlierWeight) continue;
    const effects::Conditions& moment = data.conditions[row];
    const effects::Influence<double> declared = arm.EffectsAt(moment);
    const auto at = [&](const effects::ActiveEffect* added) -> std::optional<Vec3> {
      effects::Influence<double> influence = declared;
      if (added != nullptr) effects::AddEffects({added, 1}, moment, influence);
      if (!arm.AtCommanded(data.measured(row).q, data.payloads[row], &influence, moment.tau, state))
        return std::nullopt;
      return state.p_read_W;
    };
    const auto without = at(nullptr), with = at(&effect);
    if (!without || !with) continue;
    ++used;
    all += (*with - *without).squaredNorm();
    for (std::size_t k = 0; k < values; ++k) {
      if (!IsSize(effect.term, k)) continue;
      const auto by_it = values == 1 ? with : at(&alone[k]);
      if (by_it) each[k] += (*by_it - *without).squaredNorm();
    }
  }
  TipDisplacement displacement{0, std::vector<double>(values, 0.0)};
  if (used == 0) return displacement;
  displacement.all_m = std::sqrt(all / used);
  for (std::size_t k = 0; k < values; ++k) displacement.each_m[k] = std::sqrt(each[k] / used);
  return displacement;
}

}  // namespace plumbline::measure
