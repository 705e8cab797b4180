#include "app/plant/answers/report_tables.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/base/text/text.h"
#include "app/plant/answers/state_words.h"

namespace plumbline::plant {
namespace {

constexpr std::size_t kMostRows = 10, kMostWaiting = 40;
constexpr double kDay_s = 86400;

/// @param cell  anything that names one
template <typename Named>
std::string CellName(const Named& cell) {
  return cell.line + "/" + ShownName(cell.node, cell.name);
}

std::string IntervalText(const Interval& mm, double factor = 1) {
  return fmt::format("{:.3f} ({:.3f} to {:.3f})", factor * mm.value, factor * mm.low,
                     factor * mm.high);
}

std::string SignedIntervalText(const Interval& mm, double factor = 1) {
  return fmt::format("{:+.3f} ({:+.3f} to {:+.3f})", factor * mm.value, factor * mm.low,
                     factor * mm.high);
}

std::string ProbabilityText(double p) {
  return p < 0.0001 ? "<0.0001" : fmt::format("{:.2g}", p);
}

ReportTable WorstTable(const PlantReport& report) {
  ReportTable table{
      "Worst cells",
      "Median over days of the daily mean residual; days of at least five probes. 95 % "
      "interval, widened because neighbouring days resemble each other. Wild probes are not in it.",
      {"cell", "arm model", "residual [mm]", "max", "wild"},
      {}};
  for (std::size_t k = 0; k < std::min(report.levels.size(), kMostRows); ++k) {
    const CellLevel& level = report.levels[k];
    const double all = static_cast<double>(level.probes + level.wild);
    table.rows.push_back({CellName(*level.cell), level.cell->arm_model,
                          IntervalText(level.level_mm), fmt::format("{:.2f}", level.max_mm),
                          fmt::format("{:.1f} %", 100 * static_cast<double>(level.wild) / all)});
  }
  if (table.rows.empty()) table.note = "No cell has six days with five probes yet.";
  return table;
}

ReportTable DriftTable(const ReportData& data, const PlantReport& report) {
  ReportTable table{
      "Cells that drift", "", {"cell", "days", "residual [mm / 30 d]", "moves", "p"}, {}};
  for (const CellDrift& drift : report.drifts) {
    if (drift.p_adjusted > kSignificance) continue;
    table.rows.push_back({CellName(*drift.cell), fmt::format("{}", drift.size_mm.days),
                          SignedIntervalText(drift.size_mm.slope, kMonth_days),
                          fmt::format("{:.3f}", kMonth_days * drift.moves_mm),
                          ProbabilityText(drift.p_adjusted)});
  }
  table.note = fmt::format(
      "{} of {} cells tested drift since {}; {} have fewer than {} days under one model and were "
      "not tested. Theil-Sen slope of the size with 95 % interval; `moves` is the slope of the "
      "mean residual vector. p is adjusted for {} cells (Holm) and for the correlation of "
      "neighbouring days, taken from all cells. Of simulated reports on steady cells whose days "
      "are autoregressive with at most 0.7, no more than 5 % had a false entry.",
      table.rows.size(), report.drifts.size(), DateText(data.period.first_day), report.too_few_days,
      kMinTrendDays, report.drifts.size());
  if (report.detectable_mm) {
    table.note += fmt::format(
        " No entry does not mean no drift: a trend of ±{:.3f} mm in 30 days would be listed in "
        "about half of the cells.",
        kMonth_days * *report.detectable_mm);
  }
  if (report.never_significant > 0) {
    table.note += fmt::format(
        " {} of the tested cells have too few days to be listed among so many cells, however "
        "they drift: give a larger --days.",
        report.never_significant);
  }
  table.with_slopes = true;
  return table;
}

ReportTable GroupTable(const std::string& title, const std::string& what, double factor,
                       const std::vector<GroupAnswer>& groups, const char* yes) {
  ReportTable table{title,
                    fmt::format("Median over the cells of {}, with 95 % interval; sign test, "
                                "adjusted for all groups (Holm).",
                                what),
                    {"group", "cells", "median [mm]", "p", ""},
                    {}};
  for (const GroupAnswer& group : groups) {
    const std::string name = group.kind + " " + group.name;
    const std::string cells = fmt::format("{}", group.cells);
    if (!group.median_mm) {
      table.rows.push_back({name, cells, "", "", "too few cells"});
      continue;
    }
    table.rows.push_back({name, cells, SignedIntervalText(group.median_mm->median, factor),
                          ProbabilityText(group.p_adjusted),
                          group.p_adjusted <= kSignificance ? yes : "none shown"});
  }
  return table;
}

ReportTable ShiftTable(const ReportData& data, const PlantReport& report) {
  const ReportPeriod& period = data.period;
  ReportTable table{fmt::format("Changed at {}", DateText(period.first_day)),
                    "",
                    {"cell", "days", "difference [mm]", "model", "p"},
                    {}};
  for (const CellShift& shift : report.shifts) {
    if (shift.p_adjusted > kSignificance) continue;
    table.rows.push_back({CellName(*shift.cell),
                          fmt::format("{}+{}", shift.size_mm.days_before, shift.size_mm.days_after),
                          SignedIntervalText(shift.size_mm.difference),
                          shift.other_model ? "changed" : "same",
                          ProbabilityText(shift.p_adjusted)});
  }
  table.note = fmt::format(
      "{} of {} cells tested differ from the {} days before; {} have fewer than {} days on one "
      "side. Hodges-Lehmann difference of the daily mean residual with 95 % interval; p adjusted "
      "for all cells (Holm). A difference has the date in common with the event, not "
      "necessarily the cause.",
      table.rows.size(), report.shifts.size(), period.compared_days, report.too_few_shift_days,
      kMinShiftDays);
  if (const int bin = period.bin_days(); period.compared_days < kMinShiftDays * bin) {
    table.note += fmt::format(
        " The time since then is taken by {} days, so that {} days before it are too few: give "
        "--days {} or more.",
        bin, period.compared_days, kMinShiftDays * bin);
  }
  return table;
}

ReportTable ModelTable(const ReportData& data) {
  ReportTable table{"Models that await approval", "", {"cell", "in force", "proposed"}, {}};
  std::size_t waiting = 0;
  for (const ReportedCell& cell : data.cells) {
    if (cell.proposed_model <= 0) continue;
    if (++waiting > kMostWaiting) continue;
    table.rows.push_back(
        {CellName(cell), fmt::format("{}", cell.model), fmt::format("{}", cell.proposed_model)});
  }
  table.note = fmt::format("{} of {} cells.", waiting, data.cells.size());
  return table;
}

ReportTable LensTable(const ReportData& data) {
  ReportTable table{"Stale lenses", "", {"cell", "camera", "since", "reason"}, {}};
  for (const StaleLens& lens : data.lenses) {
    if (table.rows.size() == kMostWaiting) break;
    table.rows.push_back({CellName(lens), lens.camera,
                          text::TextFromUtc(lens.since_utc).substr(0, 10), lens.reason});
  }
  table.note = fmt::format("{}. Measurements of such a camera are not used by its cell.",
                           data.lenses.size());
  return table;
}

ReportTable MaintenanceTable(const PlantReport& report) {
  ReportTable table{
      "Where one maintenance would pay most", "", {"cell", "expected [mm]", "based on"}, {}};
  for (std::size_t k = 0; k < std::min(report.maintenance.size(), kMostRows); ++k) {
    const Maintenance& one = report.maintenance[k];
    table.rows.push_back({CellName(*one.cell), IntervalText(one.reduction_mm), one.basis});
  }
  table.note = fmt::format(
      "Reduction of the mean residual if the cell returns to its own earlier level, or to that of "
      "its siblings, ranked by the lower bound; {} cells. The bounds of a rise hold for all {} "
      "cells at once (95 %, Bonferroni), those against siblings for one cell. Whether a repair "
      "restores that level is not known from residuals; a diagnosis says what to repair.",
      report.maintenance.size(), report.levels.size());
  return table;
}

ReportTable DiagnosisTable(const ReportData& data) {
  ReportTable table{"Newest diagnoses", "The newest of each cell.", {"cell", "day", "answer"}, {}};
  std::vector<DiagnosisAnswer> newest = data.diagnoses;
  std::stable_sort(newest.begin(), newest.end(),
                   [](const auto& a, const auto& b) { return a.utc > b.utc; });
  for (std::size_t k = 0; k < std::min(newest.size(), kMostWaiting); ++k) {
    table.rows.push_back(
        {CellName(newest[k]), text::TextFromUtc(newest[k].utc).substr(0, 10), newest[k].summary});
  }
  return table;
}

}  // namespace

std::string NameOf(const ReportedCell& cell) {
  return CellName(cell);
}

std::string DateText(int day) {
  return text::TextFromUtc(kDay_s * day).substr(0, 10);
}

std::optional<int> DayFromText(const std::string& text) {
  const auto utc = text::UtcFromText(text + "T00:00:00Z");
  if (!utc || DateText(static_cast<int>(*utc / kDay_s)) != text) return std::nullopt;
  return static_cast<int>(*utc / kDay_s);
}

std::string ReportHeading(const ReportData& data, const PlantReport& report) {
  std::string text = fmt::format("{} cells, {} of them with probes on at least six days, {} to {}",
                                 data.cells.size(), report.levels.size(),
                                 DateText(data.period.first_day), DateText(data.period.last_day));
  if (const int bin = data.period.bin_days(); bin > 1) {
    text += fmt::format(". In this long period a \"day\" below is the mean of {} days", bin);
  }
  return text;
}

std::vector<ReportTable> TablesOf(const ReportData& data, const PlantReport& report) {
  std::vector<ReportTable> tables = {WorstTable(report), DriftTable(data, report)};
  tables.push_back(GroupTable("Drift by arm model, series and age", "the slope in 30 days",
                              kMonth_days, report.drift_groups, "drift"));
  if (data.period.compared_days > 0) {
    tables.push_back(ShiftTable(data, report));
    tables.push_back(GroupTable("Change by arm model, series and age", "the difference", 1,
                                report.shift_groups, "change"));
  }
  tables.push_back(MaintenanceTable(report));
  tables.push_back(ModelTable(data));
  tables.push_back(LensTable(data));
  if (!data.diagnoses.empty()) tables.push_back(DiagnosisTable(data));
  return tables;
}

}  // namespace plumbline::plant
