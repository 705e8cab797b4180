// The diagnosis as a child process at low priority.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/os/child_process.h"
#include "firmware-like/result.h"

namespace plumbline::cell {

/// One run of a program in its own process group, at nice 19, with standard output and error going
/// to a file. The destructor kills the group; the kernel kills the program when the thread that
/// started it ends, however that happens.
class DiagnosisProcess {
 public:
  /// @param arguments  the program's path first
  static Result<DiagnosisProcess> Start(const std::vector<std::string>& arguments,
                                        const std::string& output_file);

  /// nullopt while it runs; then the reason of its failure, empty for exit code 0.
  std::optional<std::string> Poll();
  void Kill() { child_.End(); }

 private:
  DiagnosisProcess(os::ChildProcess child, std::string output_file)
      : child_(std::move(child)), output_file_(std::move(output_file)) {}
  os::ChildProcess child_;
  std::string output_file_;
};

}  // namespace plumbline::cell
