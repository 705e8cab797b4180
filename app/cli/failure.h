// Exit codes of the commands, and error messages of a failing one.
#pragma once

#include <iostream>
#include <string>

namespace plumbline::cli {

// Exit codes of the plumbline commands.

inline constexpr int kExitOk = 0;
inline constexpr int kExitFault = 1;  ///< faulty or unreadable input, or an alarm
inline constexpr int kExitUsage = 2;  ///< wrong arguments, unwritable output, no running daemon
inline constexpr int kExitInterrupted = 130;  ///< SIGINT or SIGTERM; no file was changed

inline int Fail(const std::string& why, int code = kExitFault) {
  std::cerr << why << '\n';
  return code;
}

inline int Interrupted() {
  return Fail("interrupted; no file was changed", kExitInterrupted);
}

}  // namespace plumbline::cli
