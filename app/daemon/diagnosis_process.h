// The diagnosis as a child process at low priority.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

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
  DiagnosisProcess(DiagnosisProcess&& other) noexcept;
  DiagnosisProcess(const DiagnosisProcess&) = delete;
  DiagnosisProcess& operator=(const DiagnosisProcess&) = delete;
  DiagnosisProcess& operator=(DiagnosisProcess&&) = delete;
  ~DiagnosisProcess() { Kill(); }

  /// Nothing while it runs; then how it ended, empty for exit code 0.
  std::optional<std::string> Poll();
  void Kill();

 private:
  DiagnosisProcess(pid_t pid, std::string output_file)
      : pid_(pid), output_file_(std::move(output_file)) {}
  pid_t pid_;
  std::string output_file_;
};

/// The program `plumbline` beside this one; the environment variable PLUMBLINE_PROGRAM names
/// another.
std::string PlumblineProgram();

}  // namespace plumbline
