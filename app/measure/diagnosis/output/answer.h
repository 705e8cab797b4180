// Machine-readable output of a diagnosis: DIAGNOSIS.json and next_poses.csv.
#pragma once

#include <string>

#include "app/measure/diagnosis/result/diagnosis.h"

namespace plumbline::measure {

/// DIAGNOSIS.json, schema 1: keys, order and units as documented, with a final newline. Non-finite
/// numbers are written as null.
/// @param next_poses_file  value of the key `next_poses`, which is null if this is empty
std::string AnswerJson(const Diagnosis& diagnosis, const std::string& next_poses_file);

/// The proposed poses in the columns of test_poses.csv: q1_deg.. (q<i>_mm for a prismatic joint),
/// and payload_kg if the cell has a [payload]. Angles are written to 1e-5 deg, as in measured
/// files. Rows are in the order of execution. Columns written only if some pose needs them:
/// qd<i>.., qdd<i>.. (motion at the moment of measurement), wait_min (before the move to the pose)
/// and measure (0 for a via pose that is passed and not measured, otherwise 1). TableFromCsv reads
/// the file and does not mistake the last two columns for measurements.
std::string NextPosesCsv(const Diagnosis& diagnosis, const model::CellModel& cell);

}  // namespace plumbline::measure
