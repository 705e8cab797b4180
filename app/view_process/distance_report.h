// Distances and points of the object table, asked for by name.
#pragma once

#include <string>
#include <vector>

namespace plumbline {

struct DistanceOptions {
  std::string config_file;
  std::vector<std::string> names;  ///< of [[distance]], [[point]] or objects of a pair; none: all
  bool json = false;
  double state_wait_s = 5, meshes_wait_s = 60;
};

/// Measures in the running daemon's newest state, and prints.
/// @return the process's exit code: 0 all that was asked for is measured; 1 faults in configuration
///         or table, a name that is not in it, or something is not in place; 2 no daemon, or the
///         answer cannot be written
int TellDistances(const DistanceOptions& options);

}  // namespace plumbline
