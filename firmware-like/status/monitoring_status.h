// Status of monitoring: probes, drift monitor, diagnosis, and the model in force.
#pragma once

#include <cstdint>

#include "firmware-like/geometry/pose.h"

namespace plumbline::status {

/// Versions of the cell model, and the origin of the one in force. Version 0 means none.
struct ModelStatus {
  int applied = 0, proposed = 0, declared = 0;
  bool fitted = false;  ///< the model in force was fitted to measured points
  int effects = 0;      ///< number of effects in the model in force
};

struct MonitoringStatus {
  bool recording = false;            ///< probes are accepted
  bool drift_alarm = false;          ///< the probe residuals have changed
  bool learning = false;             ///< the drift monitor is collecting its reference
  bool reference_refused = false;    ///< the reference probes disagree; drift is not monitored
  bool radius_contradicted = false;  ///< the reference contradicts the stated 95 % radius
  bool diagnosing = false;           ///< a diagnosis is running
  bool fault = false;                ///< journal or diagnosis failed; see the log
  bool storage_unavailable = false;  ///< the state directory cannot be written
  bool settled = false;              ///< start-up is complete: `recording` is final
  std::uint32_t probes = 0;          ///< probes written to the journal since start-up
  int reference_learned = 0, reference_wanted = 0;  ///< probes of the drift monitor's reference
  std::uint32_t quarantined = 0;   ///< probes in the journal that await a person's decision
  double drift_statistic = 0;      ///< relative to the threshold; alarm above 1
  Vec3 residual_m = Vec3::Zero();  ///< of the latest probe, measured minus predicted, in W
  ModelStatus model;

  bool proposal_waiting() const { return model.proposed != 0; }
};

}  // namespace plumbline::status
