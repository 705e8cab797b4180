// What the command line answers to the shell.
#pragma once

namespace plumbline {

inline constexpr int kExitOk = 0;
inline constexpr int kExitFault = 1;  ///< the input has faults; they are told
inline constexpr int kExitUsage = 2;  ///< wrong arguments, a file that cannot be read or written

}  // namespace plumbline
