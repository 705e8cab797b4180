// Comparison of two cell models, by the keys of cell.toml.
#pragma once

#include <string>
#include <vector>

#include "firmware-like/model/cell_model.h"

namespace plumbline::cell {

/// Lists every value in which two cell models differ, in the keys and units of cell.toml, new
/// values last: "robot.joint[2].compliance_rad_per_Nm 1e-06 -> 2e-06", "domain.payload_kg absent
/// -> [0, 60]". Empty if both are the same model, however their files are written: comments, order
/// of keys, number formats and explicit defaults do not count, nor do the robot's name and the
/// origin of an effect.
std::vector<std::string> CellDifferences(const model::CellModel& before,
                                         const model::CellModel& after);

/// The same for two cell.toml texts. Identical texts do not differ. If either text cannot be parsed
/// by this version, returns one line that says so: the two cannot be assumed to be equal.
std::vector<std::string> CellTextDifferences(const std::string& before, const std::string& after);

}  // namespace plumbline::cell
