// The arguments of plumbline beam, and the tool that they describe.
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

namespace plumbline {

struct BeamOptions {
  std::map<std::string, double> numbers;  ///< by key of [tool]; only those given
  std::string section, material, theory, cell;
  int elements = 10;
  std::string forces, direction = "y";
  std::optional<double> at_mm;
  double moment_Nm = 0, acceleration_m_s2 = 0, angular_acceleration_rad_s2 = 0;
  bool own_weight = false, stress = false, csv = false, json = false, paper_table2 = false;
  std::vector<std::string> points;

  bool LoadsTheMass() const {
    return own_weight || acceleration_m_s2 != 0 || angular_acceleration_rad_s2 != 0;
  }
};

/// A fault of the arguments, with its remedy: `--at-mm: 900 lies outside the beam, ...`.
struct BeamUsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The same for a file that was named.
struct BeamCellError : BeamUsageError {
  using BeamUsageError::BeamUsageError;
};

/// Declares the arguments; `options` must outlive the command.
void AddBeamOptions(CLI::App& command, BeamOptions& options);

/// The tool of the flags or of the cell, checked by the reader of cell.toml. Throws BeamUsageError,
/// or BeamCellError of the cell, with every fault.
Tool BeamToolOf(const BeamOptions& options);

/// The points of --point-mm. Throws BeamUsageError.
std::vector<BeamPoint> BeamPointsOf(const BeamOptions& options, double length_m);

/// Forces of `100,200,300` or of a series `FIRST:STEP:LAST` (`100:100:1000`), in the unit given.
/// @return the forces, at most 10000, or what is wrong with the text
Result<std::vector<double>> ForceSeriesFromText(const std::string& text);

}  // namespace plumbline
