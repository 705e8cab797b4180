// Plausibility warnings for values that are in range but probably unintended: a wrong unit, a
// forgotten key.
#pragma once

#include <vector>

#include "app/base/config/toml_reader.h"
#include "firmware-like/correction/assembly_point.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::config {

/// True if an angle of the list looks like radians, that is, like a multiple of a quarter turn as
/// people round it (1.5708, 3.14), and none exceeds a full turn in radians.
bool LookLikeRadians(const std::vector<double>& angles_deg);

/// Warns if the angles of the key look like radians.
void WarnAboutRadians(const TomlTable& table, std::string_view key);

/// True if the point was probably written in metres.
/// @param p_OP  as written, in the frame of the point [m]
bool IsPointInMetres(const Vec3& p_OP);

/// True if the point is farther from the robot's base than the arm with its tool reaches.
bool IsFarAway(const model::CellModel& cell, const correction::AssemblyPoint& point);

/// Warns about gravity that points up or has the wrong magnitude, lengths that look like metres,
/// angles and joint limits that look like radians, and values that contradict the arm's size
/// (arm_size.h).
/// @param joints  the [[robot.joint]] tables of `table`, one for each of robot.joints
void WarnAboutUnlikelyRobot(const TomlTable& table, const std::vector<TomlTable>& joints,
                            const model::Robot& robot);

/// Warns about a tip or centre of gravity that was probably written in metres or is metres away,
/// and about a payload at the flange of a long tool.
void WarnAboutUnlikelyLoad(const TomlTable& root, const model::CellModel& cell);

/// Warns about a point that was probably written in metres or is out of reach.
/// @param p_OP  as written, in the frame of the point [m]
void WarnAboutUnlikelyPoint(const TomlTable& table, const Vec3& p_OP,
                            const correction::AssemblyPoint& point, const model::CellModel& cell);

}  // namespace plumbline::config
