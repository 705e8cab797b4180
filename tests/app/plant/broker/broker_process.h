// Debian's mosquitto as a child process on its own port.
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <fstream>
#include <string>
#include <thread>

#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"

namespace plumbline::test {

inline std::string MosquittoProgram() {
  for (const char* path : {"/usr/sbin/mosquitto", "/usr/bin/mosquitto"}) {
    if (access(path, X_OK) == 0) return path;
  }
  return "";
}

/// With a timeout long enough for a loaded machine.
template <typename Condition>
bool Soon(Condition holds, double seconds = 60) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < until) {
    if (holds()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return holds();
}

/// A port that is free at this moment.
inline int FreePort() {
  const int descriptor = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  REQUIRE(bind(descriptor, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
  REQUIRE(getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size) == 0);
  close(descriptor);
  return ntohs(address.sin_port);
}

inline bool Answers(int port) {
  const int descriptor = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  const bool open = connect(descriptor, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  close(descriptor);
  return open;
}

class BrokerProcess {
 public:
  /// @param lines  further lines of its configuration
  explicit BrokerProcess(const std::string& lines = "allow_anonymous true\n")
      // As root it would switch to another user, who cannot read this folder.
      : configuration_("listener " + std::to_string(port_) + " 127.0.0.1\nuser root\n" +
                       "persistence true\npersistence_location " + folder_.path() +
                       "/\nmax_queued_messages 0\n" + lines) {
    Start();
  }
  /// @param configuration  all of it; with `user root`
  /// @param port           that it then listens on
  BrokerProcess(std::string configuration, int port)
      : port_(port), configuration_(std::move(configuration)) {
    Start();
  }
  ~BrokerProcess() { Stop(); }
  BrokerProcess(const BrokerProcess&) = delete;
  BrokerProcess& operator=(const BrokerProcess&) = delete;

  /// Restarts it on the same port.
  void Start() {
    const std::string file = folder_.path() + "/mosquitto.conf";
    std::ofstream(file) << configuration_;
    pid_ = fork();
    if (pid_ == 0) {
      const int log = open(LogFile().c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
      dup2(log, STDERR_FILENO);
      dup2(log, STDOUT_FILENO);
      const std::string program = MosquittoProgram();
      execl(program.c_str(), program.c_str(), "-c", file.c_str(), nullptr);
      _exit(127);
    }
    INFO(FileText(LogFile()));
    REQUIRE(Soon([this] { return Answers(port_); }));
  }
  /// Keeps subscribers' sessions across a restart, as a plant's broker does.
  void Stop() { EndBy(SIGTERM); }
  /// It forgets what it has not saved.
  void Kill() { EndBy(SIGKILL); }
  /// Makes it read passwords and access lists again.
  void Reload() const { kill(pid_, SIGHUP); }
  /// Makes it save now, and waits until it has.
  void Save() const {
    const std::size_t before = Saves();
    kill(pid_, SIGUSR1);
    REQUIRE(Soon([&] { return Saves() > before; }));
    // The message precedes the file, which is written beside the old one and then renamed.
    const std::string fresh = folder_.path() + "/mosquitto.db.new";
    REQUIRE(Soon([&] { return access(fresh.c_str(), F_OK) != 0; }));
  }
  int port() const { return port_; }
  std::string Log() const { return FileText(LogFile()); }

 private:
  std::string LogFile() const { return folder_.path() + "/log"; }
  std::size_t Saves() const {
    const std::string log = Log();
    std::size_t count = 0;
    for (auto at = log.find(kSaving); at != std::string::npos; at = log.find(kSaving, at + 1)) {
      ++count;
    }
    return count;
  }
  void EndBy(int signal) {
    if (pid_ <= 0) return;
    kill(pid_, signal);
    waitpid(pid_, nullptr, 0);
    pid_ = -1;
  }
  static constexpr const char* kSaving = "Saving in-memory database";

  const TemporaryFolder folder_;
  const int port_ = FreePort();
  const std::string configuration_;
  pid_t pid_ = -1;
};

}  // namespace plumbline::test
