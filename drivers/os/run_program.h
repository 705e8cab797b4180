// A program run to its end: text in, text out.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "drivers/os/child_process.h"
#include "firmware-like/result.h"

namespace plumbline {

struct RunLimits {
  double time_s = 60;
  std::size_t output_bytes = std::size_t{64} << 20;
};

/// What a program wrote, and how it ended.
struct ProgramRun {
  ChildEnd end;
  std::string output, complaint;  ///< its standard output and standard error
};

/// Gives `input` to the program's standard input and gathers its output until it ends. A program
/// that goes beyond a limit is killed.
/// @param arguments  the program's path first
/// @return           or why not: "cannot be started: ...", "did not end within 60 s", "wrote more
///                   than 64 MiB"
Result<ProgramRun> RunProgram(const std::vector<std::string>& arguments, std::string_view input,
                              const RunLimits& limits = {});

}  // namespace plumbline
