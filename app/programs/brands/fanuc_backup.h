// Frames, tools and payloads from the backup of a FANUC controller.
#pragma once

#include "app/programs/program.h"

namespace plumbline::programs::fanuc {

/// True for a listing of system variables (sysframe.va, symotn.va): `[*SYSTEM*]$MNUTOOL ...`.
bool IsVariableListing(std::string_view bytes);

/// Reads from such a listing what belongs to group 1 and appends it:
///   $MNUFRAME[1,n], $MNUTOOL[1,n]: X, Y, Z [mm], W, P, R [deg]
///   $PLST_GRP1[n]: $PAYLOAD [kg], $PAYLOAD_X, _Y, _Z [cm] from the centre of the faceplate
///   [payload units: Lincoln Electric, "Payload", Fanuc screens MOTION PERFORMANCE]
/// A payload without mass, or with a negative one, was not entered. A payload is the whole load at
/// the faceplate, the tool with it.
void ReadVariableListing(std::size_t file, Program& program);

}  // namespace plumbline::programs::fanuc
