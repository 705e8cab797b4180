// Exit codes of the plumbline commands.
#pragma once

namespace plumbline::cli {

inline constexpr int kExitOk = 0;
inline constexpr int kExitFault = 1;  ///< faulty or unreadable input, or an alarm
inline constexpr int kExitUsage = 2;  ///< wrong arguments, unwritable output, no running daemon
inline constexpr int kExitInterrupted = 130;  ///< SIGINT or SIGTERM; no file was changed

}  // namespace plumbline::cli
