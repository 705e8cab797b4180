// Steps of a FANUC TP program from its statements.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "app/programs/brands/fanuc_positions.h"
#include "app/programs/brands/fanuc_statements.h"
#include "app/programs/program.h"

namespace plumbline::programs::fanuc {

/// Frames, tools and payloads that the programs assign at run time (`UFRAME[1]=PR[3]`), by key,
/// with the place; "UFRAME *" where the number is computed.
using Assigned = std::map<std::string, std::string>;
void FindAssigned(const std::vector<Statement>& statements, const std::string& file,
                  Assigned& assigned);

/// Displacements of all targets that the programs use: "TRACK", "SOFTFLOAT".
void FindShifts(const std::vector<Statement>& statements, std::set<std::string>& shifts);

/// What the statements of one program refer to.
struct Surroundings {
  const PointNumbers* points = nullptr;
  const std::set<std::string>* shifts = nullptr;  ///< see FindShifts()
  const Assigned* assigned = nullptr;
};

/// Appends the steps to `routine`. Marks in `program` the points that a computed index may mean,
/// and adds remarks about motions that are disabled.
///
/// A program or macro that was not given is a call to what is in none of the files. It may select
/// another tool and frame, too, but each point states those that it was taught in, and the
/// controller refuses to execute it in others (alarms INTP-250 and INTP-252, unless $MCR.$UFRCHK
/// switches the check off [industrialmonitordirect.com]). So a selection that is still right needs
/// no more, and one that is not is seen as a difference from the point.
///
/// Special motions, whose end is not the taught place: search
/// (Skip, SkipJump, Search), INC, COORD (a place on a positioner), RTCP (a tool that stands in the
/// cell). Weaving and arc welding ride on the taught path and change no target; seam tracking
/// (TRACK), Touch Offset and SOFTFLOAT move the robot off all targets until they end.
void ReadRoutine(const std::vector<Statement>& statements, const Surroundings& around,
                 Program& program, Routine& routine);

/// Names of the programs that a routine calls, in capitals.
std::set<std::string> CalledBy(const Routine& routine);

/// A to Z in capitals.
std::string Capitals(std::string_view text);

}  // namespace plumbline::programs::fanuc
