// Values inside their ranges that hardly anybody means: another unit, a forgotten key. All
// warnings.
#pragma once

#include <vector>

#include "app/config/toml_reader.h"
#include "firmware-like/correction/assembly_point.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// True where an angle of the list looks like radians, a quarter turn or a multiple of it, rounded
/// as people write it (1.5708, 3.14), and none is larger than a whole turn in radians.
bool LookLikeRadians(const std::vector<double>& angles_deg);

/// Where those of the key do.
void WarnOfRadians(const TomlTable& table, std::string_view key);

/// True for a point as if in metres. @param p_OP  as written, in the frame of the point [m]
bool IsPointInMetres(const Vec3& p_OP);

/// True for a point farther from the robot's base than the arm and its tool are long.
bool IsFarAway(const CellModel& cell, const AssemblyPoint& point);

/// Gravity that points up or is not the earth's; lengths of all joints as if in metres; angles
/// and joint limits as if in radians; what the arm's own size speaks against (arm_size.h).
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
