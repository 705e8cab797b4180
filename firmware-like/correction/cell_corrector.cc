#include "firmware-like/correction/cell_corrector.h"

#include <algorithm>

#include "firmware-like/effects/written.h"

namespace plumbline::correction {
namespace {

bool ReadsTime(const model::CellModel& cell) {
  if (cell.domain && cell.domain->t_s) return true;
  const std::vector<effects::ActiveEffect> effects = effects::ActiveEffectsOf(cell);
  return std::any_of(effects.begin(), effects.end(), [](const effects::ActiveEffect& effect) {
    return effect.seen_t_s || effects::ReadsTime(effect.term);
  });
}

}  // namespace

CellCorrector::CellCorrector(const model::CellModel& cell, const CorrectionLimits& limits)
    : solver_(cell, limits),
      uncertainty_(cell, solver_.arm(), limits.deviation),
      reads_time_(ReadsTime(cell)),
      time_zero_s_(cell.domain ? cell.domain->time_zero_s : std::nullopt) {}

effects::Conditions CellCorrector::ConditionsOf(const loads::Payload& payload, double utc_s,
                                                const std::optional<double>& temp_C) const {
  effects::Conditions conditions;
  conditions.payload_kg = payload.mass_kg;
  if (time_zero_s_) conditions.t_s = utc_s - *time_zero_s_;
  conditions.temp_C = temp_C;
  return conditions;
}

void CellCorrector::StateRadius(const loads::Payload& payload,
                                const effects::Conditions& conditions, const Vec3& p_TP,
                                Correction& correction) {
  const model::StatedRadius stated =
      uncertainty_.At(arm(), correction.q, deflection::LoadStatement::Stated(payload), conditions,
                      correction.extrapolated, p_TP);
  if (!stated.known()) correction.code = CorrectionCode::kNotConverged;
  correction.uncertainty_m = stated.radius_m;
  correction.basis = stated.basis;
}

}  // namespace plumbline::correction
