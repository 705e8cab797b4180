// Reliable standard output: closed descriptors and write errors are detected.
#pragma once

namespace plumbline::cli {

/// Opens descriptors 0 to 2 that the shell closed (`>&-`), so that no file opened later gets their
/// number and receives the output; printing then fails, as it should. Call first in main().
void ReserveClosedOutputs();

/// Flushes standard output. Returns true if everything was written; otherwise (full disk, closed
/// descriptor) prints an error and returns false. A reader that has exited (`| head -1`) is not an
/// error.
bool FlushStandardOutput();

}  // namespace plumbline::cli
