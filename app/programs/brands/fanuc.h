// Programs of FANUC controllers: TP listings (.ls).
#pragma once

#include "app/programs/brand.h"

namespace plumbline::programs {

/// FANUC TP: `.ls` files with the sections /PROG, /ATTR, /APPL, /MN, /POS and /END, in English and
/// German, and system variables of a backup (`sysframe.va`, `symotn.va`), which give the frames,
/// tools and payloads.
///
/// Keys of the settings: "UTOOL n", "UFRAME n", "PAYLOAD n". UFRAME 0 is the base frame of the
/// robot (world) and UTOOL 0 the faceplate [onerobotics.com, "UFRAMEs and UTOOLs"]. UF and UT of a
/// point are what it was taught in; the program executes it in UFRAME_NUM and UTOOL_NUM. There is
/// no place for a mark: a remark would renumber the lines, and the comment of the header has 16
/// characters.
const Brand& FanucTp();

}  // namespace plumbline::programs
