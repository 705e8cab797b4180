// The plant's report as text of 80 columns, as JSON, and as one HTML file.
#pragma once

#include <string>

#include "app/plant/answers/report_tables.h"

namespace plumbline::plant {

std::string ReportText(const ReportData& data, const PlantReport& report);

/// All cells, not only those that the tables list. Names and types are stable within "schema" 1.
std::string ReportJson(const ReportData& data, const PlantReport& report);

/// A page without scripts or references to other files, that may be printed.
std::string ReportHtml(const ReportData& data, const PlantReport& report);

}  // namespace plumbline::plant
