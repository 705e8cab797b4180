// Reader of the priors that the plant has delivered to a cell.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/measure/siblings/fleet_prior.h"

namespace plumbline::measure {

inline constexpr const char* kPriorFolder = "/etc/plumbline/priors";         ///< of *.prior
inline constexpr const char* kPriorKeyFolder = "/etc/plumbline/plant-keys";  ///< of *.pem

/// Prior of a cell's arm model.
struct InstalledPrior {
  std::optional<FleetPrior> prior;
  std::vector<std::string> problems;  ///< each names its file and the remedy
};

/// The newest prior of this arm model that one of the keys verifies and whose arms are declared
/// like this cell. Priors of other models are ignored, and a folder without priors is no
/// problem. Of two priors of one day, the one created later counts.
/// @param path  a folder of *.prior, or one file, for which another model is a problem; only
///              kPriorFolder may be missing
/// @param keys  a folder of *.pem
InstalledPrior FindPrior(const std::string& path, const std::string& keys,
                         const model::CellModel& cell);

/// Reads and verifies one signed prior. Keys that cannot be read are named if no other verifies it.
/// @return  an error that names the file and the remedy
Result<FleetPrior> ReadPrior(const std::string& file, const std::string& keys);

/// False if it is dated later than now, as a wrong clock of the plant or of this computer makes it:
/// no later prior would ever replace it.
bool IsOfPast(const FleetPrior& prior, double tolerance_s);

}  // namespace plumbline::measure
