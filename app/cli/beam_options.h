// Command line arguments of plumbline beam and the tool that they describe.
#pragma once

#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "app/cli/beam_paper.h"
#include "firmware-like/result.h"

namespace CLI {
class App;
}

namespace plumbline::cli {

struct BeamOptions {
  std::map<std::string, double> numbers;  ///< the given values by their key in [tool]
  std::string section, material, theory, cell;
  int elements = 10;
  std::string forces, direction = "y";
  std::optional<double> at_mm;
  double moment_Nm = 0, acceleration_m_s2 = 0, angular_acceleration_rad_s2 = 0;
  bool own_weight = false, stress = false, csv = false, json = false, paper_table2 = false;
  std::vector<std::string> points;
  std::optional<int> tool;  ///< number, with --cell

  bool LoadsTheMass() const {
    return own_weight || acceleration_m_s2 != 0 || angular_acceleration_rad_s2 != 0;
  }
};

/// A fault in the arguments, with its remedy: `--at-mm: 0 is not on the free side of the clamp;
/// ...`.
struct BeamUsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A fault in the cell file given by --cell.
struct BeamCellError : BeamUsageError {
  using BeamUsageError::BeamUsageError;
};

/// Adds the options to the command; `options` must outlive it.
void AddBeamOptions(CLI::App& command, BeamOptions& options);

/// A tool, and which of several tools of a cell it is; empty if it is the only one.
struct BeamTool {
  model::Tool tool;
  std::string used;
};

/// The tool described by the flags or by the cell file, checked by the reader of cell.toml.
/// @throws BeamUsageError or BeamCellError, listing every fault
BeamTool BeamToolOf(const BeamOptions& options);

/// The points of --point-mm.
/// @throws BeamUsageError
std::vector<BeamPoint> BeamPointsOf(const BeamOptions& options, double length_m);

/// Parses a list `100,200,300` or a series `FIRST:STEP:LAST` (`100:100:1000`) of forces [N].
/// @return at most 10000 forces, or the fault in the text
Result<std::vector<double>> ForceSeriesFromText(const std::string& text);

}  // namespace plumbline::cli
