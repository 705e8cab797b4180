// Files of `plumbline program`: those given, what an earlier run left in them, and those written.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/programs/brand.h"
#include "app/programs/correction/rewriting.h"

namespace plumbline::cli {

// Every function that fails has printed why.

/// A file of the program, and where it comes from.
struct ProgramInput {
  programs::SourceFile file;
  std::string record;  ///< text of the record beside it; empty: none
  std::string given;   ///< path as given
};

/// Reads each file once, even if it is given by two paths.
std::optional<std::vector<ProgramInput>> ReadProgramInputs(const std::vector<std::string>& paths);

std::vector<programs::SourceFile> FilesOf(const std::vector<ProgramInput>& inputs);

/// Which files an earlier run has corrected, by their marks, records or the index beside the cell;
/// nullopt if the points of one were changed since.
/// @param again  start from the originals instead, which replace these files in `inputs`, and no
///               file counts as corrected
std::optional<std::vector<bool>> CorrectedBefore(const std::string& cell, bool again,
                                                 const programs::Brand& brand,
                                                 programs::Reading& reading,
                                                 std::vector<ProgramInput>& inputs);

/// Where the program is written.
struct ProgramOutput {
  std::string folder;  ///< empty: "corrected" beside each file
  bool again = false;  ///< a corrected file may be replaced by its new correction
  bool force = false;  ///< any file may be
};

/// Path of each output; empty for a file that was corrected before, which is not written.
std::optional<std::vector<std::string>> OutputPathsOf(const ProgramOutput& output,
                                                      const std::vector<ProgramInput>& inputs,
                                                      const std::vector<bool>& corrected_before);

/// Writes all files or none: the program, a record beside each file, and the report.
/// Existing files are replaced if they are byte for byte what an earlier run wrote. An input that
/// is its own output and does not change is not written; its path is cleared.
/// @param report  path and text of the report; no path: none
bool WriteProgram(const ProgramOutput& output, std::vector<std::string>& paths,
                  const std::vector<ProgramInput>& inputs, const programs::Program& program,
                  const programs::ProgramCorrection& correction,
                  const programs::Rewritten& rewritten,
                  const std::pair<std::string, std::string>& report);

/// Adds corrected files whose language has no place for a mark to the index beside the cell.
void RememberUnmarked(const std::string& cell, const programs::Brand& brand,
                      const std::vector<std::string>& paths, const programs::Rewritten& rewritten);

}  // namespace plumbline::cli
