// Frames and scale that rows on artefacts leave free.
#pragma once

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/diagnosis/linear_problem.h"

namespace plumbline::measure {

/// Adds the frames and the scale that rows on artefacts leave free:
///   base_frame  no instrument and no artefact of known position relates the robot's base to W
///   scale       all lengths of the arm change in proportion, and unknown positions with them
void AddFreeOfArtefacts(const LinearProblem& problem, Diagnosis& diagnosis);

}  // namespace plumbline::measure
