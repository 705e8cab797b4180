#include "app/cell/daemon/probe_row.h"

#include <Eigen/Eigenvalues>

namespace plumbline::cell {

JournalRow JournalRowFromProbe(const CycleEvent& event, const std::string& session,
                               double epoch_utc_s, const std::vector<model::Artefact>& artefacts,
                               const std::vector<config::CameraConfig>& cameras) {
  const Probe& probe = event.probe;
  JournalRow row;
  using Source = JournalRow::Source;
  row.source = probe.by_gauge       ? Source::kGauge
               : probe.covariance_W ? Source::kCamera
                                    : Source::kPlc;
  row.unix_ms = probe.unix_ms;
  static_cast<model::MeasuredPoint&>(row) = probe;
  row.t_s = probe.utc_s - epoch_utc_s;
  row.session = session;
  if (!probe.by_gauge) row.command = probe.sequence;
  row.predicted_W = probe.predicted_W;
  if (probe.radius_m > 0) row.predicted_radius_m = probe.radius_m;
  if (probe.quarantined) row.quarantine = JournalRow::Quarantine::kWaiting;
  row.model_version = event.model_version;
  if (probe.artefact_number > 0 && probe.artefact_number <= artefacts.size()) {
    row.artefact = artefacts[probe.artefact_number - 1U].name;
  }
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    if ((probe.cameras >> k & 1U) == 0) continue;
    row.camera +=
        (row.camera.empty() ? "" : "+") + std::string(status::CameraNameText(cameras[k].name));
  }
  return row;
}

bool IsTooUncertain(const JournalRow& row, double probe_sigma_m) {
  if (!row.covariance_W) return false;
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(*row.covariance_W, Eigen::EigenvaluesOnly);
  return !(axes.eigenvalues()[2] <= probe_sigma_m * probe_sigma_m);
}

bool IsUsableForMonitoring(const JournalRow& row, double probe_sigma_m) {
  return row.measured_W && row.predicted_W && row.measured_W->allFinite() &&
         !IsTooUncertain(row, probe_sigma_m);
}

}  // namespace plumbline::cell
