// Signal that decides the verdict, with the component of the residual that follows it most.
#pragma once

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/report/signal_bins.h"

namespace plumbline::measure {

/// A component of the residual.
enum class Component { kX, kY, kZ, kRadial, kTangential };

/// "in x", "away from the base's axis".
const char* NameOf(Component component);

struct DecidingSignal {
  const SignalTrace* signal = nullptr;  ///< null if none was recorded
  Component component = Component::kZ;
  Cloud cloud, rejected;  ///< rejected: outliers, drawn only if they may show the cause
  double share_before = 0, share_after = 0;  ///< of the mean square
};

/// Selects among the drivers of an unknown cause, otherwise among all signals: the signal and
/// component whose binned means explain most of the residual before correction, or, for an unknown
/// cause without drivers, after it.
DecidingSignal SelectSignal(const Diagnosis& diagnosis, const model::CellModel& cell);

/// A cloud with further points, sorted again.
Cloud Joined(const Cloud& a, const Cloud& b);

}  // namespace plumbline::measure
