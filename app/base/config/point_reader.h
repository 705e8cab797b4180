// Reader of the [[frame]] and [[point]] tables of a configuration.
#pragma once

#include <vector>

#include "app/base/config/toml_reader.h"
#include "firmware-like/correction/assembly_point.h"

namespace plumbline::config {

/// Reads the assembly points with their work-object frames. The frames "measurement" (the default)
/// and "base" (the robot's) exist without being declared.
///
/// @param cell  provides the base and the number, types and limits of the joints; null if the cell
///              could not be read, then nothing is checked against it
/// @return      the points in file order, with X_WP in the measurement frame
std::vector<correction::AssemblyPoint> PointsFromToml(const TomlTable& root,
                                                      const model::CellModel* cell);

}  // namespace plumbline::config
