#include "app/measure/report/achieved_accuracy.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace plumbline::measure {
namespace {

constexpr int kFrameParameters = 6, kTipParameters = 3;

/// The time of each row; empty if none was recorded.
PerRow<double> TimesOf(const Diagnosis& diagnosis) {
  for (const SignalTrace& signal : diagnosis.signals) {
    if (signal.name == "t_s" && signal.values.size() == diagnosis.rows.size()) return signal.values;
  }
  return {};
}

/// Number of parameters of the frames that the rows determine.
int FreeFrameParameters(const model::CellModel& cell, int sessions) {
  const model::Measurement& measurement = cell.measurement;
  return sessions * ((measurement.frame_known ? 0 : kFrameParameters) +
                     (measurement.tool_known ? 0 : kTipParameters));
}

double EffectParameters(const Diagnosis& diagnosis) {
  double count = diagnosis.discrepancy_parameters;
  for (const Finding& finding : diagnosis.findings) {
    count += static_cast<double>(finding.effect.values.size());
  }
  return count;
}

struct Lists {
  std::vector<Reading> before, after;
};

bool MeasuresPosition(const RowTrace& row) {
  using enum ObservationKind;
  return row.kind == kPosition || row.kind == kPose;
}

Lists ReadingsOf(const Diagnosis& diagnosis, bool held_out) {
  Lists lists;
  std::map<std::string, int> sessions;
  const PerRow<double> times = TimesOf(diagnosis);
  for (const RowIndex index : diagnosis.rows.indices()) {
    const RowTrace& row = diagnosis.rows[index];
    if (row.outlier || !MeasuresPosition(row) ||
        (held_out && !(row.held_out_before && row.held_out_after)))
      continue;
    const Vec3 before = held_out ? *row.held_out_before : row.before;
    const Vec3 after = held_out ? *row.held_out_after : row.after;
    if (!before.allFinite() || !after.allFinite() || !row.p_measured.allFinite()) continue;
    Reading reading;
    reading.pose = row.pose.value();
    reading.session =
        sessions.emplace(row.session, static_cast<int>(sessions.size())).first->second;
    if (!times.empty() && std::isfinite(times[index])) reading.t_s = times[index];
    reading.attained_W = row.p_measured;
    reading.error_W = before;
    lists.before.push_back(reading);
    reading.error_W = after;
    lists.after.push_back(reading);
  }
  return lists;
}

double SquareSum(const std::vector<Reading>& readings) {
  double sum = 0;
  for (const Reading& reading : readings) sum += reading.error_W.squaredNorm();
  return sum;
}

}  // namespace

std::string FittedText(const AchievedAccuracy& achieved) {
  if (achieved.frame_fitted && achieved.tip_fitted)
    return "the instrument's frame and the tool's tip";
  if (achieved.frame_fitted) return "the instrument's frame";
  return achieved.tip_fitted ? "the tool's tip" : "";
}

AchievedAccuracy AchievedAccuracyOf(const Diagnosis& diagnosis, const model::CellModel& cell) {
  AchievedAccuracy achieved;
  achieved.rejected_rows = static_cast<int>(std::ranges::count_if(
      diagnosis.rows, [](const RowTrace& row) { return row.outlier && MeasuresPosition(row); }));
  if (cell.measurement.kind == model::MeasurementKind::kRange) {
    achieved.why_none = "the instrument measures ranges, not positions";
    return achieved;
  }
  achieved.noise_refuted = diagnosis.declared_noise_too_small;
  achieved.frame_fitted = !cell.measurement.frame_known;
  achieved.tip_fitted = !cell.measurement.tool_known;
  achieved.other_rows = static_cast<int>(std::ranges::count_if(
      diagnosis.rows, [](const RowTrace& row) { return !MeasuresPosition(row); }));
  if (achieved.other_rows > 0 && achieved.other_rows == static_cast<int>(diagnosis.rows.size())) {
    achieved.why_none =
        "the rows touch artefacts, which shows an error relative to the artefact or along one "
        "direction, not that of a position";
    return achieved;
  }
  achieved.held_out = std::ranges::any_of(
      diagnosis.rows, [](const RowTrace& row) { return row.held_out_after.has_value(); });
  const Lists lists = ReadingsOf(diagnosis, achieved.held_out);
  achieved.rows = static_cast<int>(lists.before.size());
  if (lists.before.empty()) {
    achieved.why_none = "no row can be used";
    return achieved;
  }
  std::set<std::string> sessions;
  for (const RowTrace& row : diagnosis.rows) sessions.insert(row.session);
  const bool corrected =
      diagnosis.withheld.empty() && !(diagnosis.findings.empty() && diagnosis.discrepancy.empty());

  Contributions common;
  common.instrument_m = diagnosis.row_sigma_m ? diagnosis.row_sigma_m : cell.measurement.sigma_m;
  common.joint_reading_m = diagnosis.joint_reading_sigma_m;
  common.lengths = 3.0 * achieved.rows;
  const double frames = FreeFrameParameters(cell, static_cast<int>(sessions.size()));
  const double fitted = frames + (corrected ? EffectParameters(diagnosis) : 0);
  common.residual_degrees_of_freedom = std::max(1.0, common.lengths - fitted);
  common.residual_m =
      std::sqrt(SquareSum(corrected ? lists.after : lists.before) /
                (achieved.held_out ? common.lengths : common.residual_degrees_of_freedom));
  achieved.before = {CharacteristicsOf(lists.before), common};
  achieved.before->contributions.parameters = frames;
  if (!corrected) return achieved;
  achieved.after = {CharacteristicsOf(lists.after), common};
  achieved.after->contributions.parameters = fitted;
  return achieved;
}

}  // namespace plumbline::measure
