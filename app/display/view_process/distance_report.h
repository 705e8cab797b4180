// Report of the object table's distances, pairs and points (`plumbline distance`).
#pragma once

#include <string>
#include <vector>

namespace plumbline::display {

struct DistanceOptions {
  std::string config_file;
  std::vector<std::string> names;  ///< of [[distance]], [[point]] or paired objects; empty: all
  bool json = false;
  double state_wait_s = 5, meshes_wait_s = 60;
};

/// Measures in the running daemon's newest state and prints the result.
/// @return  the exit code: 0 everything requested is measured; 1 a fault in configuration or table,
///          an unknown name, or an object without a pose; 2 no daemon, or writing failed
int PrintDistances(const DistanceOptions& options);

}  // namespace plumbline::display
