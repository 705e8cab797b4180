// The daemon under a service manager: the test implements systemd's side of the protocol on real
// sockets [sd_notify(3), sd_listen_fds(3)].
#include <arpa/inet.h>
#include <poll.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "tests/app/cell/daemon/daemon_process.h"
#include "tests/app/cell/daemon/demo_config.h"
#include "tests/virtual_cell/running_cell.h"

namespace plumbline::service_manager_test {

using namespace plumbline::test;
using virtual_cell::RegisterClient;
using virtual_cell::RunningCell;
using virtual_cell::VirtualCellOptions;

namespace {

/// The notification socket of a service manager.
class NotifySocket {
 public:
  NotifySocket() : path_(folder_.path() + "/notify") {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, sizeof address.sun_path - 1);
    socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    REQUIRE(bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
  }
  ~NotifySocket() { close(socket_); }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  const std::string& path() const { return path_; }

  /// True if a message containing this text arrives in time; other messages are ignored.
  bool Hears(const std::string& text, int within_ms) { return First({text}, within_ms) == text; }

  /// The text that arrives first; "" if none does in time.
  std::string First(const std::vector<std::string>& texts, int within_ms) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(within_ms);
    for (;;) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          end - std::chrono::steady_clock::now());
      pollfd waiting{socket_, POLLIN, 0};
      if (left.count() <= 0 || poll(&waiting, 1, static_cast<int>(left.count())) <= 0) return "";
      const std::string message = Receive();
      for (const std::string& text : texts) {
        if (message.find(text) != std::string::npos) return text;
      }
    }
  }

  /// The descriptors received for the descriptor store, under this name.
  const std::vector<int>& kept() const { return kept_; }
  static constexpr char kKept[] = "modbus-client";

 private:
  std::string Receive() {
    char bytes[4096];
    alignas(cmsghdr) char control[CMSG_SPACE(64 * sizeof(int)) + CMSG_SPACE(sizeof(ucred))];
    iovec part{bytes, sizeof bytes};
    msghdr header{};
    header.msg_iov = &part;
    header.msg_iovlen = 1;
    header.msg_control = control;
    header.msg_controllen = sizeof control;
    const ssize_t got = recvmsg(socket_, &header, MSG_CMSG_CLOEXEC);
    std::string message(bytes, static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    for (cmsghdr* c = CMSG_FIRSTHDR(&header); c != nullptr; c = CMSG_NXTHDR(&header, c)) {
      if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_RIGHTS) continue;
      CHECK(message == std::string("FDSTORE=1\nFDNAME=") + kKept);
      for (std::size_t at = CMSG_LEN(0); at < c->cmsg_len; at += sizeof(int)) {
        int descriptor = -1;
        std::memcpy(&descriptor, reinterpret_cast<char*>(c) + at, sizeof descriptor);
        kept_.push_back(descriptor);
      }
    }
    return message;
  }

  TemporaryFolder folder_;
  std::string path_;
  int socket_ = -1;
  std::vector<int> kept_;
};

VirtualCellOptions IdleCell() {
  VirtualCellOptions options;
  options.idle = true;
  return options;
}

/// Stops one thread of another process, like a debugger [ptrace(2)].
class HeldThread {
 public:
  HeldThread(pid_t process, const std::string& name) {
    namespace fs = std::filesystem;
    for (const auto& task : fs::directory_iterator("/proc/" + std::to_string(process) + "/task")) {
      std::string comm;
      std::getline(std::ifstream(task.path() / "comm"), comm);
      if (comm == name) thread_ = std::stoi(task.path().filename());
    }
    INFO(name);
    REQUIRE(thread_ != 0);
    REQUIRE(ptrace(PTRACE_SEIZE, thread_, nullptr, nullptr) == 0);
    REQUIRE(ptrace(PTRACE_INTERRUPT, thread_, nullptr, nullptr) == 0);
    REQUIRE(waitpid(thread_, nullptr, __WALL) == thread_);
  }
  /// If the process was killed meanwhile, it must be waited for, or it would remain a zombie.
  ~HeldThread() { waitpid(thread_, nullptr, __WALL); }
  HeldThread(const HeldThread&) = delete;
  HeldThread& operator=(const HeldThread&) = delete;

 private:
  pid_t thread_ = 0;
};

/// A socket that listens on a port of the kernel's choice, and that port.
struct Listening {
  int descriptor = socket(AF_INET, SOCK_STREAM, 0);
  int port = 0;

  Listening() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    REQUIRE(bind(descriptor, reinterpret_cast<sockaddr*>(&address), size) == 0);
    REQUIRE(listen(descriptor, 16) == 0);
    getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size);
    port = ntohs(address.sin_port);
  }
  ~Listening() { close(descriptor); }
  Listening(const Listening&) = delete;
  Listening& operator=(const Listening&) = delete;

  /// As a service manager hands it over, and what it kept behind it.
  void Inherit(const std::vector<int>& kept = {}) const {
    std::vector<int> away;  // so that none lies where another has to be
    for (const int one : kept) away.push_back(fcntl(one, F_DUPFD_CLOEXEC, 100));
    int at = 3;  // SD_LISTEN_FDS_START
    if (descriptor != at) dup2(descriptor, at);
    std::string names = "modbus";
    for (const int one : away) {
      dup2(one, ++at);
      names += std::string(":") + NotifySocket::kKept;
    }
    setenv("LISTEN_FDS", std::to_string(1 + kept.size()).c_str(), 1);
    setenv("LISTEN_FDNAMES", names.c_str(), 1);
    setenv("LISTEN_PID", std::to_string(getpid()).c_str(), 1);
  }
};

}  // namespace

TEST_CASE("the service manager is notified of ready, watchdog, reload and stop") {
  RunningCell cell(IdleCell());
  NotifySocket manager;
  DaemonProcess daemon(DemoConfig(cell.robot(), "generic"), std::nullopt, [&] {
    setenv("NOTIFY_SOCKET", manager.path().c_str(), 1);
    setenv("WATCHDOG_USEC", "2000000", 1);
    setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  });
  INFO(daemon.Log());
  REQUIRE(manager.Hears("READY=1", 20000));
  CHECK(manager.Hears("WATCHDOG=1", 20000));
  CHECK(manager.Hears("points valid", 20000));
  CHECK(manager.Hears("WATCHDOG=1", 20000));
  daemon.Signal(SIGHUP);
  CHECK(manager.Hears("RELOADING=1", 20000));
  CHECK(manager.Hears("READY=1", 20000));
  daemon.Signal(SIGTERM);
  CHECK(manager.Hears("STOPPING=1", 20000));
  CHECK(daemon.Wait() == 0);
}

TEST_CASE("a hanging thread triggers an immediate restart by the service manager") {
  RunningCell cell(IdleCell());
  NotifySocket manager;
  DaemonProcess daemon(DemoConfig(cell.robot(), "generic"), std::nullopt, [&] {
    setenv("NOTIFY_SOCKET", manager.path().c_str(), 1);
    setenv("WATCHDOG_USEC", "60000000", 1);  // nobody waits for it to run out
    setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  });
  REQUIRE(manager.Hears("READY=1", 20000));
  REQUIRE(manager.Hears("WATCHDOG=1", 20000));
  const HeldThread held(daemon.pid(), GENERATE("cycle", "robot", "modbus", "monitoring"));
  CHECK(manager.Hears("WATCHDOG=trigger", 30000));
  daemon.Signal(SIGKILL);
}

TEST_CASE("a slow robot does not let the watchdog expire during a reload") {
  const Listening robot;  // takes the question, and never answers
  NotifySocket manager;
  const std::string config =
      WithLine(DemoConfig("127.0.0.1:" + std::to_string(robot.port), "generic"), "robot",
               "timeout_ms", "5000");
  DaemonProcess daemon(config, std::nullopt, [&] {
    setenv("NOTIFY_SOCKET", manager.path().c_str(), 1);
    setenv("WATCHDOG_USEC", "2000000", 1);
    setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  });
  const int asked = accept(robot.descriptor, nullptr, nullptr);
  pollfd question{asked, POLLIN, 0};
  REQUIRE(poll(&question, 1, 20000) == 1);
  REQUIRE(manager.Hears("READY=1", 20000));
  daemon.Signal(SIGHUP);
  REQUIRE(manager.Hears("RELOADING=1", 20000));
  CHECK(manager.First({"WATCHDOG=1", "READY=1"}, 20000) == "WATCHDOG=1");
  CHECK(manager.Hears("READY=1", 20000));
  close(asked);
}

TEST_CASE("a PLC's connection survives the daemon, however it ends") {
  RunningCell cell(IdleCell());
  const Listening socket;
  NotifySocket manager;
  const std::string config = DemoConfig(cell.robot(), "generic");
  const auto start = [&] {
    return std::make_unique<DaemonProcess>(config, std::nullopt, [&] {
      setenv("NOTIFY_SOCKET", manager.path().c_str(), 1);
      socket.Inherit(manager.kept());
    });
  };
  auto daemon = start();
  REQUIRE(manager.Hears("READY=1", 20000));
  RegisterClient client("plumblined", "127.0.0.1:" + std::to_string(socket.port), 1, 10);
  CHECK(client.Read(0, 2).Word(0) == 0x504C);
  REQUIRE(manager.Hears("FDSTORE=1", 20000));
  REQUIRE(manager.kept().size() == 1);
  for (const int ending : {SIGKILL, SIGTERM}) {
    daemon->Signal(ending);
    CHECK(daemon->Wait() == (ending == SIGKILL ? 128 + SIGKILL : 0));
    daemon = start();
    INFO(daemon->Log());
    REQUIRE(manager.Hears("READY=1", 20000));
    CHECK(client.Read(0, 2).Word(0) == 0x504C);  // by the connection of before
  }
  for (const int kept : manager.kept()) close(kept);
}

TEST_CASE("a listening socket of the service manager is served and survives the daemon") {
  RunningCell cell(IdleCell());
  const Listening socket;
  const std::string plc = "127.0.0.1:" + std::to_string(socket.port);
  const std::string config = DemoConfig(cell.robot(), "generic");
  for (int start = 0; start < 2; ++start) {
    DaemonProcess daemon(config, std::nullopt, [&] { socket.Inherit(); });
    CHECK(daemon.Plc() == plc);
    RegisterClient client("plumblined", plc, 1, 10);
    CHECK(client.Read(0, 2).Word(0) == 0x504C);
    daemon.Signal(SIGTERM);
    CHECK(daemon.Wait() == 0);
    CHECK_FALSE(daemon.Says("plc.listen"));
  }
  {
    DaemonProcess daemon(WithLine(config, "plc", "listen", "\"0.0.0.0\""), std::nullopt,
                         [&] { socket.Inherit(); });
    CHECK(daemon.Awaits(
        "plc.listen is 0.0.0.0, but the service manager's socket listens on 127.0.0.1"));
  }
  // Nobody serves now, and still a client is not refused: it waits in the socket's queue.
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(socket.port));
  const int client = ::socket(AF_INET, SOCK_STREAM, 0);
  CHECK(connect(client, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
  close(client);
}

}  // namespace plumbline::service_manager_test
