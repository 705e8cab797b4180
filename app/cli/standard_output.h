// Whether what was printed has arrived.
#pragma once

namespace plumbline {

/// Occupies descriptors 1 and 2 where the shell closed them (`>&-`), so that no file opened later
/// gets their number and their text; printing then fails, as it must. Call first in main().
void OccupyClosedOutputs();

/// Flushes standard output. True where all of it was written; otherwise (a full disk, a closed
/// descriptor) says so on standard error. A reader that has gone (`| head -1`) is no fault.
bool StandardOutputArrived();

}  // namespace plumbline
