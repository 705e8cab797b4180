// Corrector of one cell that also states the 95 % radius of its results.
#pragma once

#include <optional>

#include "firmware-like/correction/correct.h"
#include "firmware-like/deflection/landing_uncertainty.h"

namespace plumbline::correction {

/// Not thread-safe, because the uncertainty owns scratch memory. Does not allocate once
/// constructed.
class CellCorrector {
 public:
  CellCorrector(const model::CellModel& cell, const CorrectionLimits& limits);

  const Corrector& solver() const { return solver_; }
  const deflection::LoadedArm& arm() const { return solver_.arm(); }
  /// True if the correction or its radius depends on time.
  bool reads_time() const { return reads_time_; }

  /// Conditions read by the cell's effects, for the robot at standstill with this payload.
  /// @param utc_s  since 1970; counted from the time zero of the cell's domain
  effects::Conditions ConditionsOf(const loads::Payload& payload, double utc_s,
                                   const std::optional<double>& temp_C) const;

  /// Sets the correction's radius and basis, or its code if no radius can be computed.
  /// @param p_TP  the tool point in the tip's frame [m]
  void StateRadius(const loads::Payload& payload, const effects::Conditions& conditions,
                   const Vec3& p_TP, Correction& correction);

 private:
  Corrector solver_;
  deflection::LandingUncertainty uncertainty_;
  bool reads_time_;
  std::optional<double> time_zero_s_;
};

}  // namespace plumbline::correction
