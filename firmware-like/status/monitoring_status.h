// Status of the monitoring: probes, drift monitor, diagnosis, and the model in force.
#pragma once

#include <cstdint>

#include "firmware-like/geometry/pose.h"

namespace plumbline {

/// The cell model's versions and what the one in force rests on. Version 0: none.
struct ModelStatus {
  int applied = 0, proposed = 0, declared = 0;
  bool fitted = false;  ///< the model in force was fitted to measured points, not only declared
  int effects = 0;      ///< in the model in force
};

struct MonitoringStatus {
  bool recording = false;            ///< probes are accepted
  bool drift_alarm = false;          ///< the probes' residuals have changed
  bool learning = false;             ///< the drift monitor is taking its reference
  bool reference_refused = false;    ///< the reference probes disagree; drift is not monitored
  bool diagnosing = false;           ///< a diagnosis is running
  bool fault = false;                ///< journal or diagnosis failed; see the log
  bool storage_unavailable = false;  ///< the state directory cannot be written
  bool settled = false;              ///< it is decided whether probes are recorded
  std::uint32_t probes = 0;          ///< written to the journal since the start
  std::uint32_t quarantined = 0;     ///< probes in the journal that await a person's decision
  double drift_statistic = 0;        ///< alarms above 1
  Vec3 residual_m = Vec3::Zero();    ///< of the last probe, measured minus predicted, W
  ModelStatus model;

  bool proposal_waiting() const { return model.proposed != 0; }
};

}  // namespace plumbline
