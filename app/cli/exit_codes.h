// What the command line answers to the shell.
#pragma once

namespace plumbline {

inline constexpr int kExitOk = 0;
inline constexpr int kExitFault = 1;  ///< faults in the input, unreadable files too, or alarms
inline constexpr int kExitUsage = 2;  ///< wrong arguments, unwritable output, no daemon there
inline constexpr int kExitInterrupted = 130;  ///< by SIGINT or SIGTERM; no file was changed

}  // namespace plumbline
