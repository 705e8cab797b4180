// Values inside their ranges that hardly anybody means: another unit, a forgotten key. All
// warnings.
#pragma once

#include <vector>

#include "app/config/toml_reader.h"
#include "firmware-like/correction/assembly_point.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// Gravity that points up or is not the earth's; lengths of all joints as if in metres; angles as
/// if in radians.
/// @param joints  the [[robot.joint]] of `table`, one for each of robot.joints
void WarnOfUnlikelyRobot(const TomlTable& table, const std::vector<TomlTable>& joints,
                         const Robot& robot);

/// A tip or a centre of gravity as if in metres or metres away, or a payload at the flange of a
/// long tool.
void WarnOfUnlikelyLoad(const TomlTable& root, const CellModel& cell);

/// A point as if in metres, or farther from the robot's base than the arm and its tool are long.
/// @param p_OP  as written, in the frame of the point [m]
void WarnOfUnlikelyPoint(const TomlTable& table, const Vec3& p_OP, const AssemblyPoint& point,
                         const CellModel& cell);

}  // namespace plumbline
