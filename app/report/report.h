// A diagnosis as one HTML file that an engineer can hand to the customer.
#pragma once

#include <string>
#include <vector>

#include "app/diagnosis/diagnosis.h"
#include "app/report/gnuplot.h"

namespace plumbline {

/// Where the data came from, and what worked on it.
struct ReportSource {
  std::string cell_file, data_file;  ///< names without folders
  int rows = 0;
  std::vector<int> unreadable_lines;
  std::string date;     ///< YYYY-MM-DD
  std::string version;  ///< of this program
};

/// The report: self-contained, without scripts or anything from a network. Where gnuplot does not
/// draw, a note stands in place of the pictures, with what to do about it.
std::string ReportHtml(const Diagnosis& diagnosis, const CellModel& cell,
                       const ReportSource& source, const GnuplotOptions& gnuplot = {});

}  // namespace plumbline
