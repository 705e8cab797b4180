// Jobs of Yaskawa (Motoman) controllers: INFORM (.JBI).
#pragma once

#include "app/programs/brand.h"

namespace plumbline::programs {

/// INFORM: jobs (`.JBI`) and the tools of the controller (`TOOL.CND`: TCP, mass and centre of
/// gravity).
///
/// Keys of the settings: "TOOL n", "USER n"; "ROBOT" and "BASE" are the base frame of the robot,
/// the latter unless the job moves base axes. Header lines (///TOOL, ///USER, ///POSTYPE,
/// ///RECTAN,
/// ///PULSE, ///RCONF) hold for the points that follow them [NX100 manual, pp. 41-43].
///
/// Points C of a job in ///RECTAN are corrected. Points in ///PULSE count the motors' encoders: to
/// read them would take, for every axis, the pulses for a degree, the pulses at its zero and the
/// coupling of the wrist, which no public description of RC.PRM or ALL.PRM gives. They are refused;
/// as a relative job (attribute RJ) the same job holds poses. Position variables P are shared by
/// all jobs and stay.
///
/// Of ///RCONF, upper or lower arm, front or rear, and the ranges of R, T and S decide; flip or no
/// flip does not, because manuals define it by R (NX100 p. 140) or by B. One header serves many
/// points, so it is never rewritten.
const Brand& YaskawaJbi();

}  // namespace plumbline::programs
