// The diagnosis as a child process at low priority.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/os/child_process.h"
#include "firmware-like/result.h"

namespace plumbline {

/// One run of a program in a process group of its own, nice 19, standard output and error in a
/// file. The group is killed with this object, and the program by the kernel when the thread that
/// started it ends, however that happens.
class DiagnosisProcess {
 public:
  /// @param arguments  the program's path first
  static Result<DiagnosisProcess> Start(const std::vector<std::string>& arguments,
                                        const std::string& output_file);

  /// Nothing while it runs; then how it ended, empty for exit code 0.
  std::optional<std::string> Poll();
  void Kill() { child_.End(); }

 private:
  DiagnosisProcess(ChildProcess child, std::string output_file)
      : child_(std::move(child)), output_file_(std::move(output_file)) {}
  ChildProcess child_;
  std::string output_file_;
};

/// The program `plumbline` beside this one; the environment variable PLUMBLINE_PROGRAM names
/// another.
std::string PlumblineProgram();

}  // namespace plumbline
