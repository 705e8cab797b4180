// Report of a corrected program: as text, JSON, and a page with pictures.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "app/programs/correction/program_correction.h"

namespace plumbline::programs {

/// Everything that a report shows.
struct ReportInput {
  const Brand& brand;
  const Program& program;
  const std::vector<Refusal>& refusals;
  const ProgramCorrection& correction;
  const model::CellModel& cell;
  std::string cell_file, version, date;
  bool joints = false;  ///< joint targets were to be corrected, too
  /// Files that an earlier run corrected, by index; those behind its end were not.
  std::vector<bool> corrected_before = {};
};

/// Counts of a program's points and files.
struct ReportCounts {
  std::size_t points = 0, corrected = 0, changed = 0;  ///< changed: with other digits than before
  std::size_t left = 0;          ///< points that a motion uses and that could not be corrected
  std::size_t by_choice = 0;     ///< joint targets without --joints, points corrected before
  std::size_t unused = 0;        ///< points that no motion uses: free ones, features, offsets
  std::size_t motions_left = 0;  ///< motions to no point of the files, or to one of `left`
  std::size_t unread = 0;        ///< texts that the grammar could not parse
  double largest_before_m = 0, largest_after_m = 0, largest_rounding_m = 0;
};
ReportCounts CountsOf(const ReportInput& input);

/// A table of the corrected points, the lines that stay as they are with reasons, and the counts.
/// @param every  list every point; otherwise the first of many
std::string ReportText(const ReportInput& input, bool every);

/// The same, complete, in mm, deg and kg.
nlohmann::json ReportJson(const ReportInput& input);

/// One self-contained page: the path seen from above and from the side with the error before and
/// after, enlarged, and all tables.
std::string ReportPage(const ReportInput& input);

}  // namespace plumbline::programs
