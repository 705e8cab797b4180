// Error messages of a failing command, together with its exit code.
#pragma once

#include <iostream>
#include <string>

#include "app/cli/exit_codes.h"

namespace plumbline::cli {

inline int Fail(const std::string& why, int code = kExitFault) {
  std::cerr << why << '\n';
  return code;
}

inline int Interrupted() {
  return Fail("interrupted; no file was changed", kExitInterrupted);
}

}  // namespace plumbline::cli
