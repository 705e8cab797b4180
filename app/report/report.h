// Diagnosis report as one self-contained HTML file.
#pragma once

#include <string>
#include <vector>

#include "app/diagnosis/diagnosis.h"
#include "app/report/gnuplot.h"

namespace plumbline::report {

/// Origin of the data, for the report's data table.
struct ReportSource {
  std::string cell_file, data_file;  ///< names without folders
  int rows = 0;
  std::vector<int> unreadable_lines;
  std::string date;     ///< YYYY-MM-DD
  std::string version;  ///< program version
};

/// Formats the report, without scripts or external references. If gnuplot fails, a note with a
/// remedy replaces the figures.
std::string ReportHtml(const diagnosis::Diagnosis& diagnosis, const model::CellModel& cell,
                       const ReportSource& source, const GnuplotOptions& gnuplot = {});

}  // namespace plumbline::report
