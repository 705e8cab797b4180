#include "app/cell/daemon/row_drift_monitor.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "firmware-like/monitor/radius_contradiction.h"
#include "firmware-like/monitor/run_length.h"
#include "firmware-like/statistics/statistics.h"

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

namespace {

constexpr std::size_t kMaxRowsListed = 12;

std::string CameraText(const std::string& name) {
  return name.empty() ? "an unnamed camera" : "camera " + name;
}

/// "rows 4, 7, 9"; only the first ones if there are many.
std::string RowsText(const std::vector<std::int64_t>& ids) {
  const std::size_t listed = std::min(ids.size(), kMaxRowsListed);
  std::string text =
      fmt::format("row{} {}", ids.size() == 1 ? "" : "s",
                  fmt::join(ids.begin(), ids.begin() + static_cast<std::ptrdiff_t>(listed), ", "));
  if (listed < ids.size()) text += fmt::format(" and {} more", ids.size() - listed);
  return text;
}

/// @param step  progress callback, called between steps that take about a second in total
monitor::MonitorDesign DesignFrom(const config::MonitoringConfig& monitoring,
                                  const std::function<void()>& step) {
  monitor::MonitorRequirements requirements;
  requirements.sigma_m = monitoring.probe_sigma_m;
  requirements.shift_m = monitoring.shift_m;
  requirements.probes_per_day = monitoring.probes_per_day;
  requirements.false_alarms_per_year = monitoring.false_alarms_per_year;
  requirements.reference_probes = monitoring.reference_probes;
  requirements.reference_sd_m = monitoring.reference_sd_m;
  return monitor::MonitorDesignFor(requirements, step);
}

}  // namespace

RowDriftMonitor::RowDriftMonitor(const config::MonitoringConfig& config, log::LogSink sink,
                                 const std::function<void()>& step)
    : sink_(std::move(sink)),
      probe_sigma_m_(config.probe_sigma_m),
      drift_(DesignFrom(config, step)) {}

void RowDriftMonitor::Restart() {
  drift_.Restart();
  reference_camera_.reset();
  unmonitored_cameras_.clear();
  monitored_rows_.clear();
  alarm_row_ = 0;
}

bool RowDriftMonitor::MatchesReference(const JournalRow& row, bool replayed) {
  if (row.source != JournalRow::Source::kCamera) return true;
  if (!reference_camera_) reference_camera_ = row.camera;
  if (row.camera == *reference_camera_) return true;
  if (!replayed && unmonitored_cameras_.insert(row.camera).second) {
    sink_({log::Event::kProbesNotMonitored,
           fmt::format("probes by {} are recorded, but not monitored for drift: the reference was "
                       "taken by {}",
                       CameraText(row.camera), CameraText(*reference_camera_))});
  }
  return false;
}

std::optional<RowVerdict> RowDriftMonitor::Update(const JournalRow& row, bool replayed) {
  if (!IsUsableForMonitoring(row, probe_sigma_m_) || !MatchesReference(row, replayed))
    return std::nullopt;
  const bool was_learning = drift_.learning();
  const monitor::ProbeVerdict verdict =
      drift_.Update(*row.measured_W - *row.predicted_W, row.predicted_radius_m.value_or(0));
  if (verdict.unmonitored) return std::nullopt;
  monitored_rows_.push_back(row.id);
  if (verdict.raised) alarm_row_ = row.id;
  const bool complete = was_learning && !drift_.learning();
  if (complete && !drift_.reference_refused()) JudgeRadius();
  return RowVerdict{verdict.outlier, verdict.raised, complete};
}

/// All probes by cameras share the errors of the tags' positions, which their mean keeps.
void RowDriftMonitor::JudgeRadius() {
  const double independent = reference_camera_ ? 1 : drift_.design().reference_probes;
  radius_contradicted_ =
      monitor::ContradictsRadius(drift_.reference_m().norm(), drift_.reference_radius_m(),
                                 drift_.sigma_m() / std::sqrt(independent));
}

std::string RowDriftMonitor::ReferenceRows() const {
  const std::size_t count =
      std::min(monitored_rows_.size(),
               static_cast<std::size_t>(std::max(drift_.design().reference_probes, 0)));
  if (count == 0) return "no journal rows";
  return fmt::format("journal rows {} to {}", monitored_rows_.front(), monitored_rows_[count - 1]);
}

log::LogEntry RowDriftMonitor::ContradictionEntry() const {
  const Vec3 mean_mm = 1e3 * drift_.reference_m();
  return {
      log::Event::kRadiusContradicted,
      fmt::format(
          "probes contradict the stated 95 % radius: the mean residual of the reference, {}, is "
          "({:.3f}, {:.3f}, {:.3f}) mm, {:.3f} mm long; the radius stated there is {:.3f} mm. "
          "Radii are no longer 95 % (basis unknown). Check tool, load and measurement frame, "
          "and read the diagnosis",
          ReferenceRows(), mean_mm.x(), mean_mm.y(), mean_mm.z(), mean_mm.norm(),
          1e3 * drift_.reference_radius_m())};
}

log::LogEntry RowDriftMonitor::ReferenceEntry() const {
  if (!drift_.reference_refused()) {
    const Vec3 reference_mm = 1e3 * drift_.reference_m();
    return {
        log::Event::kReferenceLearned,
        fmt::format("drift monitor has its reference: residual ({:.3f}, {:.3f}, {:.3f}) mm, "
                    "scatter {:.3f} mm",
                    reference_mm.x(), reference_mm.y(), reference_mm.z(), 1e3 * drift_.sigma_m())};
  }
  std::vector<std::int64_t> disagree;
  for (std::size_t k = 0; k < monitored_rows_.size(); ++k) {
    if (drift_.Disagrees(static_cast<int>(k))) disagree.push_back(monitored_rows_[k]);
  }
  const double sigma_mm = 1e3 * drift_.design().sigma_m;
  const monitor::ReferenceFault fault = drift_.reference_fault();
  const std::string why =
      fault == monitor::ReferenceFault::kOutliers
          ? fmt::format(
                "{} of them are farther from the others than their scatter explains "
                "(99.99 %): {}",
                disagree.size(), RowsText(disagree))
      : fault == monitor::ReferenceFault::kScatter
          ? fmt::format("they scatter by {:.3f} mm, over {:.0f} times probe_sigma_mm ({:.3f}): {}",
                        1e3 * drift_.sigma_m(), monitor::DriftMonitor::kMaxScatterRatio, sigma_mm,
                        RowsText(disagree))
          : fmt::format(
                "they scatter by {:.3f} mm, more than probe_sigma_mm ({:.3f}), and consecutive "
                "probes are correlated: something moved while they were taken",
                1e3 * drift_.sigma_m(), sigma_mm);
  return {
      log::Event::kReferenceRefused,
      fmt::format("drift monitor's reference refused: its {} probes, rows {} to {}, disagree; "
                  "{}. Drift is not monitored. Inspect the rows (`plumbline journal show`), then "
                  "take a new reference with command 8; if poses really differ that much, raise "
                  "probe_sigma_mm",
                  monitored_rows_.size(), monitored_rows_.front(), monitored_rows_.back(), why)};
}

log::LogEntry RowDriftMonitor::AlarmEntry(Journal& journal, const std::vector<model::Joint>& joints,
                                          int model_version) const {
  const monitor::DriftAlarm& alarm = *drift_.alarm();
  const Vec3 shift_mm = 1e3 * MedianShift(journal, joints, model_version);
  return {log::Event::kDriftAlarm,
          fmt::format("drift alarm: the residual of probes changed by ({:.3f}, {:.3f}, {:.3f}) mm "
                      "within the last {} probes; row {} of the journal",
                      shift_mm.x(), shift_mm.y(), shift_mm.z(), alarm.probe - alarm.first_probe + 1,
                      alarm_row_)};
}

Vec3 RowDriftMonitor::MedianShift(Journal& journal, const std::vector<model::Joint>& joints,
                                  int model_version) const {
  const monitor::DriftAlarm& alarm = *drift_.alarm();
  const auto count = static_cast<std::size_t>(alarm.probe - alarm.first_probe + 1);
  if (count > monitored_rows_.size()) return alarm.shift_m;
  const std::vector<std::int64_t> part(monitored_rows_.end() - static_cast<std::ptrdiff_t>(count),
                                       monitored_rows_.end());
  JournalFilter filter;
  filter.after_id = part.front() - 1;
  filter.model_version = model_version;
  const auto rows = journal.Read(filter, joints);
  if (!rows || rows->empty()) return alarm.shift_m;
  Vec3 shift_m;
  for (int k = 0; k < 3; ++k) {
    std::vector<double> values;
    for (const JournalRow& row : *rows) {
      const bool monitored = std::binary_search(part.begin(), part.end(), row.id);
      if (monitored && row.measured_W && row.predicted_W) {
        values.push_back((*row.measured_W)[k] - (*row.predicted_W)[k]);
      }
    }
    if (values.empty()) return alarm.shift_m;
    shift_m[k] = statistics::MedianOf(values) - drift_.reference_m()[k];
  }
  return shift_m;
}

}  // namespace plumbline::cell
