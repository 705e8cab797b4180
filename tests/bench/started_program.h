// Programs that a benchmark starts, and the folder it works in. Each is killed when its owner is
// destroyed or the benchmark ends for any reason; tests/bench/run removes the folder in any case.
#pragma once

#include <fcntl.h>
#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "drivers/os/child_process.h"
#include "drivers/os/descriptor.h"
#include "tests/file_text.h"
#include "tests/port_file.h"

namespace plumbline::bench {

/// A folder below $TMPDIR that goes with its owner.
class WorkFolder {
 public:
  WorkFolder() {
    path_ = (std::filesystem::temp_directory_path() / "plumbline-bench-XXXXXX").string();
    if (mkdtemp(path_.data()) == nullptr) std::abort();
  }
  ~WorkFolder() {
    std::error_code failed;
    std::filesystem::remove_all(path_, failed);
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

struct StartOptions {
  std::string input = "/dev/null", output = {};  ///< output: as the log if empty
  int nice = 0;
};

/// Starts a program whose messages go to `log`. Ends the benchmark if it cannot be started.
inline os::ChildProcess StartProgram(std::vector<std::string> arguments, const std::string& log,
                                     const StartOptions& options = {}) {
  arguments[0] = os::FindProgram(arguments[0]);
  const os::Descriptor messages(open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644));
  const os::Descriptor input(open(options.input.c_str(), O_RDONLY | O_CLOEXEC));
  const os::Descriptor output(open(options.output.empty() ? log.c_str() : options.output.c_str(),
                                   O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644));
  auto started = os::ChildProcess::Start({.arguments = arguments,
                                          .descriptors = {{STDIN_FILENO, input.get()},
                                                          {STDOUT_FILENO, output.get()},
                                                          {STDERR_FILENO, messages.get()}},
                                          .nice = options.nice,
                                          .own_group = true});
  if (!started) {
    fmt::print(stderr, "{}\n", started.error());
    std::exit(1);
  }
  return std::move(started).value();
}

struct StartedDaemon {
  os::ChildProcess process;
  int port = 0;  ///< of its PLC server
};

/// Starts plumblined with `folder`/plumbline.toml and waits until it serves the PLC; its log is
/// `folder`/log. Ends the benchmark with that log if the daemon does not start.
inline StartedDaemon StartDaemon(const std::string& program, const std::string& folder) {
  const std::string log = folder + "/log", ports = folder + "/ports";
  StartedDaemon daemon{
      StartProgram({program, "--config", folder + "/plumbline.toml", "--port-file", ports}, log)};
  daemon.port = test::AwaitPort(ports, "plc", [&] { return !daemon.process.Poll(); });
  if (daemon.port > 0) return daemon;
  fmt::print(stderr, "the daemon did not start; its log:\n{}", test::FileText(log));
  std::exit(1);
}

}  // namespace plumbline::bench
