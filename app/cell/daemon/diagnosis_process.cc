#include "app/cell/daemon/diagnosis_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "drivers/files/open_failure.h"
#include "drivers/os/descriptor.h"

namespace plumbline::cell {
namespace {

constexpr int kLowestPriority = 19;  ///< the highest nice value

/// The last non-empty line of a file, at most 300 characters.
std::string LastLine(const std::string& file) {
  std::ifstream input(file);
  std::string line, last;
  while (std::getline(input, line)) {
    if (!line.empty()) last = line;
  }
  return last.substr(0, 300);
}

}  // namespace

Result<DiagnosisProcess> DiagnosisProcess::Start(const std::vector<std::string>& arguments,
                                                 const std::string& output_file) {
  const os::Descriptor output(open(
      output_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_NOFOLLOW | O_CLOEXEC, 0644));
  if (!output) {
    return Error{fmt::format("{}: {}", output_file,
                             files::WriteErrorText(output_file, std::strerror(errno)))};
  }
  auto child = os::ChildProcess::Start(
      {.arguments = arguments,
       .descriptors = {{STDOUT_FILENO, output.get()}, {STDERR_FILENO, output.get()}},
       .nice = kLowestPriority,
       .own_group = true});
  if (!child) return Error{fmt::format("cannot create a process: {}", child.error())};
  return DiagnosisProcess(std::move(child).value(), output_file);
}

std::optional<std::string> DiagnosisProcess::Poll() {
  if (!child_.started()) return "was stopped";
  const std::optional<os::ExitStatus> end = child_.Poll();
  if (!end) return std::nullopt;
  if (end->ok()) return std::string();
  std::string how = "exit status unknown";
  if (end->exit_code) how = fmt::format("exit code {}", *end->exit_code);
  if (end->signal != 0) how = fmt::format("signal {}", end->signal);
  std::string last_line = LastLine(output_file_);
  if (last_line.empty() && end->exit_code == os::ExitStatus::kNotRun) last_line = "cannot be run";
  return last_line.empty() ? how : fmt::format("{}: {}", how, last_line);
}

}  // namespace plumbline::cell
