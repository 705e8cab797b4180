// Report on how far a new model moves the configured points, for the person who decides on it.
#pragma once

#include <string>
#include <vector>

#include "firmware-like/model/cell_model.h"
#include "firmware-like/result.h"

namespace plumbline::cli {

/// What a model changes of the configured points, and why a person must confirm that.
struct ModelMoves {
  std::string text;
  std::vector<std::string> objections;  ///< see cell::Objections
};

/// Compares the corrected commands of the configured points under two models, at the configured
/// loads. Without a configuration, reports how far the unloaded tip moves and why the points cannot
/// be compared.
/// @param config_file  given by the user; if empty, the one that the daemon recorded in the state
///                     directory
/// @return why the given file cannot be used
Result<ModelMoves> MovesOfPoints(const std::string& state_directory, const std::string& config_file,
                                 const model::CellModel& in_force, const model::CellModel& next);

}  // namespace plumbline::cli
