// Shape searches for the cycles and phase of effects that are periodic in a joint angle.
#pragma once

#include "app/measure/diagnosis/shape_search.h"

namespace plumbline::measure {

/// For `gear_periodic`: amplitude sin(cycles q + phase) as a sine and a cosine column, which makes
/// the phase linear. Proposes the best cycles per turn over all joints, from 0.5 to 400, and one
/// and two cycles (eccentricity and ellipticity) on every joint. Excludes two lines on one joint
/// that its range of angles cannot resolve.
const ShapeSearch& GearPeriodicSearch();

/// For `counterbalance`: one cycle on the second joint, which carries the spring or gas cylinder of
/// heavy arms. Fixed columns for sine and cosine; nothing is searched.
const ShapeSearch& CounterbalanceSearch();

/// The strongest spectral lines of a residual along each joint angle.
/// @param residual  whitened and projected
std::vector<PeriodicLine> PeriodicLines(const LinearProblem& problem,
                                        const Eigen::VectorXd& residual);

/// Cycles per turn, from 0.5 to 400 and ascending, of lines that the rows cannot distinguish from
/// this one because the readings of its joint are equally spaced (line_aliases.h).
std::vector<double> AliasedCycles(const LinearProblem& problem, const PeriodicLine& line);

/// True if the range of the joint does not resolve two of its lines. Lines at whole cycles are
/// exempt: they are an eccentricity and its harmonics, not one line split in two.
bool Unresolved(const LinearProblem& problem, const PeriodicLine& a, const PeriodicLine& b);

/// The block of a line with other cycles per turn, of the same joint and number of trials.
Block LineAt(const Block& line, double cycles);

}  // namespace plumbline::measure
