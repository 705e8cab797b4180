#include "app/measure/diagnosis/missing_signals.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace plumbline::measure {
namespace {

void FindMissingColumns(Dataset& data) {
  const RecordedColumns& recorded = data.table.recorded;
  const auto missing = [&data](bool there, const char* what) {
    if (!there) data.not_recorded.emplace_back(what);
  };
  missing(recorded.time || recorded.clock_restarted, "t_s: drift and warm-up cannot be identified");
  missing(!recorded.clock_restarted,
          "t_s without a restart of its clock: drift and warm-up cannot be identified");
  missing(recorded.temperature, "temp_C: thermal growth cannot be identified");
  missing(data.loads_recorded(),
          "payload_kg: effects of the load can be identified only from the arm's own weight");
  missing(recorded.qd, "qd1_deg_s..: latency and viscous lag cannot be identified");
  missing(recorded.order,
          "the robot's moves between the probes: backlash by move and approach lag cannot be "
          "identified");
  missing(recorded.qdd, "qdd1_deg_s2..: inertia cannot be identified");
}

/// A warm-up follows exp(-t / time constant) from t_s = 0 on. With another time zero, it would need
/// a shifted base and sizes e^(first / time constant) times as large.
void CheckTimeZero(Dataset& data) {
  if (!data.table.recorded.time) return;
  double first_s = 1e300, last_s = -1e300;
  for (const MeasuredRow& row : data.table.rows) {
    first_s = std::min(first_s, *row.t_s);
    last_s = std::max(last_s, *row.t_s);
  }
  if (std::abs(first_s) > last_s - first_s) {
    data.not_recorded.push_back(fmt::format(
        "t_s starts at {:.4g} s and spans {:.4g} s: thermal drift is modelled from t_s = 0, so a "
        "warm-up that started with these rows cannot be identified; count t_s from its start",
        first_s, last_s - first_s));
  }
}

}  // namespace

void NoteMissingSignals(Dataset& data) {
  FindMissingColumns(data);
  CheckTimeZero(data);
  if (data.table.recorded.payload && !data.cell.payload_cog_F) {
    data.notes.emplace_back(
        "payload_kg is recorded, but the cell has no [payload] cog_mm: the column is used only as "
        "a signal, and the weight of the payload is not modelled");
  }
  const bool tags = !data.cell.measurement.reference_tags_W.empty();
  const auto& rows = data.table.rows;
  if (tags && std::none_of(rows.begin(), rows.end(),
                           [](const MeasuredRow& row) { return !row.camera.empty(); })) {
    data.notes.push_back(fmt::format(
        "[measurement] reference_tags_mm has no effect, because no {}, or the errors of the tags "
        "are not included in the stated uncertainties",
        data.table.recorded.camera
            ? "usable row names a camera: write side, rear, front or top into the column camera"
            : "row names a camera: add a column camera"));
  }
  if (!data.torques_known) {
    data.notes.emplace_back(
        "a link has no link_mass_kg, so the joint torques are unknown: compliance is fitted as "
        "gravity_sag, the products of compliance and weight that the poses identify; other effects "
        "of the load on joints cannot be identified");
  }
  if (!data.table.unreadable_lines.empty()) {
    data.notes.push_back(fmt::format("{} rows could not be read and were ignored (first: line {})",
                                     data.table.unreadable_lines.size(),
                                     data.table.unreadable_lines.front()));
  }
  if (data.cell.measurement.kind == model::MeasurementKind::kPose &&
      !data.cell.measurement.sigma_rad) {
    data.notes.emplace_back(
        "only the positions of the measured poses are used, not the orientations: declare their "
        "uncertainty as sigma_deg of [measurement] to use them");
  }
}

}  // namespace plumbline::measure
