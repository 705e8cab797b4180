// Poses that might be measured next, as rows of a data set without a measurement.
#pragma once

#include "app/diagnosis/dataset.h"

namespace plumbline {

/// Payloads [kg] at which the rows were measured, ascending; of more than three the least, the
/// middle and the largest.
std::vector<double> PayloadsSeen(const Dataset& data);

/// Random poses, each with every one of `payloads_kg`, where the robot has worked: every joint
/// within the rows' range, widened by a quarter of it and at least 5 degrees (50 mm) on either
/// side, within the joint's limits. All else (session, time, temperature, speeds, further signals)
/// is as in the last row: nobody chooses it.
Dataset PoseCandidates(const Dataset& data, const std::vector<double>& payloads_kg);

/// Lets the candidates be reached from `previous`: their last moves, and the sides they come from.
void ComeFrom(const Conditions& previous, Dataset& candidates);

}  // namespace plumbline
