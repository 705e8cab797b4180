// Debian's PostgreSQL as a child process, with its own data and a unix socket only.
#pragma once

#include <fmt/format.h>
#include <pwd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "app/plant/database/connection.h"
#include "app/plant/database/schema.h"
#include "tests/app/plant/broker/broker_process.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::test {

/// Folder of initdb and postgres; empty if they are not installed.
inline std::string PostgresPrograms() {
  const std::string folder = "/usr/lib/postgresql/15/bin/";
  return access((folder + "postgres").c_str(), X_OK) == 0 ? folder : "";
}

/// Runs without fsync: a kill of the process loses nothing, a power cut would. Superuser "owner".
class PostgresProcess {
 public:
  /// @param lines  further settings, such as "max_connections = 300"
  explicit PostgresProcess(const std::string& lines = "") {
    const passwd* const user = getuid() == 0 ? getpwnam("postgres") : nullptr;
    if (user != nullptr) {  // PostgreSQL refuses to run as root
      REQUIRE(chown(folder_.path().c_str(), user->pw_uid, user->pw_gid) == 0);
    }
    Run({PostgresPrograms() + "initdb", "-D", Data(), "-U", "owner", "--no-sync", "-A", "trust",
         "-E", "UTF8", "--locale=C"});
    Append(Data() + "/postgresql.conf",
           fmt::format("listen_addresses = ''\nunix_socket_directories = '{}'\nfsync = off\n{}\n",
                       folder_.path(), lines));
    Start();
    auto any = plant::Connection::Open(Settings("postgres"), "test");
    REQUIRE(any.ok());
    REQUIRE(any.value().Run("CREATE DATABASE plumbline").ok());
  }
  ~PostgresProcess() { Stop(SIGQUIT); }
  PostgresProcess(const PostgresProcess&) = delete;
  PostgresProcess& operator=(const PostgresProcess&) = delete;

  /// After a crash a killed process may still hold the shared memory, and the server ends at once:
  /// it is started until it stays.
  void Start() {
    const bool stays = Soon([this] {
      if (pid_ <= 0 || waitpid(pid_, nullptr, WNOHANG) == pid_) {
        if (pid_ > 0) usleep(200'000);
        pid_ = Spawn({PostgresPrograms() + "postgres", "-D", Data()});
      }
      return plant::Connection::Open(Settings("postgres"), "test").ok();
    });
    INFO(FileText(folder_.path() + "/log"));
    REQUIRE(stays);
  }
  /// @param signal  SIGTERM waits for sessions, SIGINT ends them, SIGKILL is a crash
  void Stop(int signal) {
    if (pid_ <= 0) return;
    // The server's processes, which would otherwise end in their own time.
    std::vector<pid_t> children;
    std::ifstream listed(fmt::format("/proc/{0}/task/{0}/children", pid_));
    for (pid_t child = 0; signal == SIGKILL && listed >> child;) children.push_back(child);
    kill(pid_, signal);
    for (const pid_t child : children) kill(child, signal);
    waitpid(pid_, nullptr, 0);
    pid_ = -1;
  }
  std::string Settings(const std::string& database = "plumbline",
                       const std::string& user = "owner") const {
    return fmt::format("host={} dbname={} user={}", folder_.path(), database, user);
  }
  plant::Connection Connect(const std::string& user = "owner") const {
    auto connection = plant::Connection::Open(Settings("plumbline", user), "test");
    INFO((connection.ok() ? "" : connection.error()));
    REQUIRE(connection.ok());
    return std::move(connection).value();
  }
  /// With the tables and roles of a plant.
  plant::Connection ConnectToNewPlant() const {
    plant::Connection connection = Connect();
    const auto migrated = plant::Migrate(connection);
    INFO((migrated.ok() ? "" : migrated.error()));
    REQUIRE(migrated.ok());
    REQUIRE(plant::GrantRights(connection).ok());
    return connection;
  }
  pid_t pid() const { return pid_; }

 private:
  std::string Data() const { return folder_.path() + "/data"; }
  static void Append(const std::string& file, const std::string& text) {
    std::ofstream(file, std::ios::app) << text;
  }
  pid_t Spawn(std::vector<std::string> words) const {
    if (getuid() == 0) {
      words.insert(words.begin(), {"/usr/bin/setpriv", "--reuid=postgres", "--regid=postgres",
                                   "--clear-groups", "--pdeathsig", "QUIT"});
    }
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const std::string log = folder_.path() + "/log";
    const pid_t child = fork();
    if (child == 0) {
      const int out = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0666);
      dup2(out, STDOUT_FILENO);
      dup2(out, STDERR_FILENO);
      execv(arguments.front(), arguments.data());
      _exit(127);
    }
    return child;
  }
  void Run(const std::vector<std::string>& words) const {
    int status = 0;
    waitpid(Spawn(words), &status, 0);
    INFO(FileText(folder_.path() + "/log"));
    REQUIRE(status == 0);
  }

  const TemporaryFolder folder_;
  pid_t pid_ = -1;
};

}  // namespace plumbline::test
