// A diagnosis as other programs read it: DIAGNOSIS.json and next_poses.csv.
#pragma once

#include <string>

#include "app/diagnosis/diagnosis.h"

namespace plumbline {

/// The answer in the file formats' keys, order and units (schema 1), ended by a newline. What is
/// not a finite number is null.
/// @param next_poses_file  name that `next_poses` carries; empty: null
std::string AnswerJson(const Diagnosis& diagnosis, const std::string& next_poses_file);

/// The proposed poses in the columns of test_poses.csv: q1_deg.. (q<i>_mm of a prismatic joint),
/// and payload_kg where the cell has a [payload]. Angles carry 1e-5 degree, as measured files do.
/// Rows are in the order of execution. Where it matters: qd<i>.., qdd<i>.. (motion at the moment of
/// measurement), wait_min (before the move there) and measure (0: a via pose, which is passed and
/// not measured; 1). TableFromCsv reads the file, and takes the last two for no measurement.
std::string NextPosesCsv(const Diagnosis& diagnosis, const CellModel& cell);

}  // namespace plumbline
