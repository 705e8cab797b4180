// Execution of a program to completion: standard input from a string, outputs to strings.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "drivers/os/child_process.h"
#include "firmware-like/result.h"

namespace plumbline::os {

struct RunLimits {
  double time_s = 60;
  std::size_t output_bytes = std::size_t{64} << 20;
};

/// Output and exit status of a program.
struct ProgramRun {
  ExitStatus end;
  std::string output, errors;  ///< standard output and standard error
};

/// Writes `input` to the program's standard input and collects its output until it ends. A program
/// that exceeds a limit is killed.
/// @param arguments  the program's path first
/// @return           why it failed: "cannot be started: ...", "did not end within 60 s", "wrote
///                   more than 64 MiB"
Result<ProgramRun> RunProgram(const std::vector<std::string>& arguments, std::string_view input,
                              const RunLimits& limits = {});

}  // namespace plumbline::os
