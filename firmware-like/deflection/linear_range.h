// Range in which linear beam theory describes a bent tool, and the displacement it neglects.
#pragma once

#include <optional>

#include "firmware-like/beam/beam.h"
#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline::deflection {

/// Largest tip deflection, as a share of the tool's length, for which linear theory is used without
/// a warning. There, it overstates the deflection under a transverse tip load by 0.26 % and
/// neglects that the tip moves towards the flange by 3 % of the deflection.
inline constexpr double kLargestLinearBend = 0.05;

/// Upper bound of the tip displacement that linear beam theory neglects [m]. With deflection d,
/// length L, tip compliance C = L^3 / (3 E I) and axial force N of the load:
///   n = d (12 N C / (pi^2 L))    the axial force bends the deflected tool further, d N / N_cr
///     + 2 d^2 / (3 L)            shortening 1/2 integral w'^2: 3/5 (tip force), 2/3 (tip moment)
///     + 36 d^3 / (35 L^2)        stiffening under a transverse tip force, to first order
/// Expansions of the exact solution [Bisshopp & Drucker, Quarterly of Applied Mathematics 3 (1945)
/// 272] and Euler's buckling load [Gere & Timoshenko, ch. 11]. Valid for d/L < 0.3 and N well below
/// the buckling load. 0 for a rigid tool.
/// @param state  converged state of `arm`; names tool and payload
double NeglectedByLinearTheory(const LoadedArm& arm, const LoadedState& state);

/// Tip deflection of the tool's beam as a share of its length; 0 for a rigid tool.
double BendShare(const LoadedArm& arm, const LoadedState& state);

/// Largest stress of the tool under the loads of `state` as a share of the yield strength of its
/// material [1]; nullopt if no segment has a yield strength and known outermost fibres. Allocates.
/// @param tool  the tool of `state`
std::optional<double> YieldShare(const model::Tool& tool, const LoadedState& state);
/// The same for a solved beam.
std::optional<double> YieldShare(const beam::BeamSolution& solution);

}  // namespace plumbline::deflection
