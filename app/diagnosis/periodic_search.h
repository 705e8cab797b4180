// Cycles and phase of an effect that repeats with a joint's angle.
#pragma once

#include "app/diagnosis/shape_search.h"

namespace plumbline {

/// Of `gear_periodic`: amplitude sin(cycles q + phase) as a sine and a cosine, the phase thereby
/// linear. Cycles are searched from half a cycle to 400 a turn, the best of all joints; one and two
/// whole cycles, eccentricity and ellipticity, are tried at every joint. Two lines of one joint
/// that its range of angles cannot resolve do not stand together.
const ShapeSearch& GearPeriodicSearch();

/// Of `counterbalance`: one cycle at the second joint, which carries the spring or gas cylinder of
/// heavy arms; sine and cosine are all there is to search.
const ShapeSearch& CounterbalanceSearch();

/// The strongest lines of each joint's spectrum in a residual.
std::vector<PeriodicLine> PeriodicLines(const LinearProblem& problem,
                                        const Eigen::VectorXd& residual);

}  // namespace plumbline
