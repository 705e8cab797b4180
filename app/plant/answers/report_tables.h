// Tables of the plant's report, from which text and HTML are made.
#pragma once

#include <string>
#include <vector>

#include "app/plant/answers/plant_report.h"

namespace plumbline::plant {

struct ReportTable {
  std::string title;
  std::string note;  ///< sentences: what it is based on, and what it does not say
  std::vector<std::string> heads;
  std::vector<std::vector<std::string>> rows;
  bool with_slopes = false;  ///< a plot of all slopes belongs to it
};

/// Period of which slopes are shown.
inline constexpr double kMonth_days = 30;

/// "line/cell", as ShownName() has it.
std::string NameOf(const ReportedCell& cell);

/// "2026-11-30" of a day since 1970.
std::string DateText(int day);
/// The day of "2026-11-30"; nullopt for any other text.
std::optional<int> DayFromText(const std::string& text);

std::vector<ReportTable> TablesOf(const ReportData& data, const PlantReport& report);

/// First sentence of the report: the period and the number of cells.
std::string ReportHeading(const ReportData& data, const PlantReport& report);

}  // namespace plumbline::plant
