// The real plumblined as a child process with a configuration of its own.
#pragma once

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"
#include "tests/port_file.h"

namespace plumbline::test {

class DaemonProcess {
 public:
  /// @param log_to    descriptor that gets the log in place of a file of its own
  /// @param in_child  done in the child before the program starts: its environment, its sockets
  explicit DaemonProcess(const std::string& config, std::optional<int> log_to = std::nullopt,
                         const std::function<void()>& in_child = nullptr) {
    Write(config);
    pid_ = fork();
    if (pid_ == 0) {
      const int log =
          log_to ? *log_to : open(LogFile().c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND, 0644);
      dup2(log, STDERR_FILENO);
      dup2(log, STDOUT_FILENO);
      const std::string file = ConfigFile();
      if (in_child) in_child();
      const std::string ports = PortFile();
      execl(PLUMBLINED, PLUMBLINED, "--config", file.c_str(), "--port-file", ports.c_str(),
            nullptr);
      _exit(127);
    }
  }
  ~DaemonProcess() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;

  void Write(const std::string& config) { std::ofstream(ConfigFile()) << config; }
  void Signal(int number) const { kill(pid_, number); }
  pid_t pid() const { return pid_; }

  /// The exit code, once the process ends; nothing after a minute.
  std::optional<int> Wait() {
    for (int wait = 0; wait < kWaits; ++wait) {
      int status = 0;
      if (waitpid(pid_, &status, WNOHANG) == pid_) {
        pid_ = -1;
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return std::nullopt;
  }

  std::string Log() const { return FileText(LogFile()); }
  bool Says(const std::string& text) const { return Log().find(text) != std::string::npos; }
  int Count(const std::string& text) const {
    const std::string log = Log();
    int count = 0;
    for (auto at = log.find(text); at != std::string::npos; at = log.find(text, at + 1)) ++count;
    return count;
  }
  /// Waits for a line. @return false after a minute
  bool Awaits(const std::string& text) const {
    for (int wait = 0; wait < kWaits && !Says(text); ++wait) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return Says(text);
  }
  /// "127.0.0.1:PORT" of the PLC side.
  std::string Plc() const {
    const int port = AwaitPort(PortFile(), "plc", [this] { return Running(); });
    INFO(Log());
    REQUIRE(port > 0);
    return "127.0.0.1:" + std::to_string(port);
  }
  std::string folder() const { return folder_.path(); }
  std::string ConfigFile() const { return folder_.path() + "/plumbline.toml"; }

 private:
  static constexpr int kWaits = 6000;  // of 10 ms: instrumented code on a busy machine

  /// Whether the process has not ended; does not reap it.
  bool Running() const {
    siginfo_t info{};
    return waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == 0;
  }
  std::string PortFile() const { return folder_.path() + "/ports"; }
  std::string LogFile() const { return folder_.path() + "/log"; }

  TemporaryFolder folder_;
  pid_t pid_ = -1;
};

}  // namespace plumbline::test
