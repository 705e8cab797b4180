// A measurement plan as table, robot program, list of points and picture.
#pragma once

#include <string>

#include "app/measure/plan/measurement_plan.h"

namespace plumbline::measure {

/// "tool 2, payload item 1, 3 kg": what is mounted and carried at a row; empty if neither the cell
/// numbers it nor a payload is planned.
std::string LoadText(const PlannedRow& row);

/// The rows as a table with the columns of measured.csv up to the measured ones: fill in x_mm,
/// y_mm, z_mm (or the gauge's reading) beside each row.
std::string PlanCsv(const MeasurementPlan& plan, const std::vector<model::Joint>& joints);

/// A URScript program: joint moves at low speed, with a pop-up at each row that waits for the
/// measurement. Joint angles in rad, as the language takes them.
std::string UrScript(const MeasurementPlan& plan);

/// Tab-separated points for other controllers: number, joints [deg, mm], tip in the measurement
/// frame [mm] and its roll, pitch, yaw [deg], whether the joint move is free, LoadText().
std::string PointList(const MeasurementPlan& plan, const std::vector<model::Joint>& joints);

/// Top view and side view of the tips in the order of execution, the robot's base and the
/// artefacts.
std::string PlanSvg(const MeasurementPlan& plan, const model::CellModel& cell);

}  // namespace plumbline::measure
