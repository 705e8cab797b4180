// Start and reload of the daemon in slow and faulty cases: many points, malformed files.
#include <arpa/inet.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <deque>
#include <fstream>
#include <set>

#include "firmware-like/cell_health.h"
#include "tests/app/cell/daemon/daemon_process.h"
#include "tests/app/cell/daemon/demo_config.h"
#include "tests/virtual_cell/running_cell.h"

namespace plumbline::start_test {

using namespace plumbline::test;
using virtual_cell::Eventually;
using virtual_cell::Profile;
using virtual_cell::RegisterClient;
using virtual_cell::RunningCell;
using virtual_cell::VirtualCellOptions;

namespace {

constexpr int kMany = 80;  // more than can be searched during the start
constexpr std::uint16_t kOk = 0, kNoRobot = 8, kPending = 11;

VirtualCellOptions Idle() {
  return {.profile = Profile::kGeneric, .idle = true};
}

std::string Times(int count, const std::string& piece) {
  std::string text;
  for (int k = 0; k < count; ++k) text += piece;
  return text;
}

/// The demo's configuration with its points repeated until there are `count`.
std::string WithPoints(const std::string& robot, int count) {
  const std::string text = DemoConfig(robot, "generic");
  const auto first = text.find("[[point]]");
  auto end = text.find("\n[", text.find("[[point]]", first + 1) + 1);
  end = end == std::string::npos ? text.size() : end + 1;
  const auto second = text.find("[[point]]", first + 1);
  const std::string one = text.substr(first, second - first);
  std::string points;
  for (int id = 1; id <= count; ++id) {
    std::string point = one;
    const auto at = point.find("id = ");
    points += point.replace(at, point.find('\n', at) - at, "id = " + std::to_string(id));
  }
  return text.substr(0, first) + points + text.substr(end);
}

std::uint16_t BlockOf(int index) {
  return static_cast<std::uint16_t>(2000 + 20 * index);
}

struct Block {
  bool valid;
  std::uint16_t code;
};

Block Read(RegisterClient& plc, int index) {
  const auto words = plc.Read(BlockOf(index), 20);
  return {(words.Word(1) & 1) != 0, words.Word(2)};
}

/// Silent connections, opened without waiting; the newest `held` stay open.
class Flood {
 public:
  Flood(const std::string& plc, std::size_t held)
      : port_(static_cast<std::uint16_t>(std::stoi(plc.substr(plc.find(':') + 1)))), held_(held) {}
  ~Flood() {
    for (const int fd : open_) close(fd);
  }
  Flood(const Flood&) = delete;
  Flood& operator=(const Flood&) = delete;

  void Begin(int count) {
    for (int k = 0; k < count; ++k) {
      const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
      if (fd < 0) continue;
      const linger reset{.l_onoff = 1, .l_linger = 0};  // leaves no ports in TIME_WAIT
      setsockopt(fd, SOL_SOCKET, SO_LINGER, &reset, sizeof reset);
      sockaddr_in address{};
      address.sin_family = AF_INET;
      address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      address.sin_port = htons(port_);
      static_cast<void>(connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address));
      open_.push_back(fd);
      if (open_.size() <= held_) continue;
      close(open_.front());
      open_.pop_front();
    }
  }

 private:
  std::uint16_t port_;
  std::size_t held_;
  std::deque<int> open_;
};

}  // namespace

TEST_CASE("many points are served at once, and become valid as their branches are found") {
  RunningCell cell(Idle());
  REQUIRE(cell.Tell("payload 60") == "ok");
  DaemonProcess daemon(WithPoints(cell.robot(), kMany));
  RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
  std::set<std::uint16_t> codes;
  bool first_before_last = false;
  INFO(daemon.Log());
  const auto last_is_valid = [&] {
    const Block first = Read(plc, 0), last = Read(plc, kMany - 1);
    if (!last.valid) codes.insert(last.code);
    first_before_last = first_before_last || (first.valid && !last.valid);
    return last.valid;
  };
  REQUIRE(Eventually(last_is_valid));
  CHECK(codes.count(kPending) == 1);
  CHECK(first_before_last);
  codes.erase(kPending);
  codes.erase(kNoRobot);
  CHECK(codes.empty());
  for (int k = 0; k < kMany; ++k) CHECK(Read(plc, k).code == kOk);
}

TEST_CASE("while a reload reads its files, the main thread supervises the daemon") {
  std::optional<RunningCell> cell(std::in_place, Idle());
  REQUIRE(cell->Tell("payload 60") == "ok");
  const std::string good = WithPoints(cell->robot(), 2);
  DaemonProcess daemon(good);
  RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
  REQUIRE(Eventually([&] { return Read(plc, 1).valid; }));
  // A program that writes the file slowly keeps the reader waiting for as long as it likes.
  const std::string file = daemon.ConfigFile();
  REQUIRE(std::filesystem::remove(file));
  REQUIRE(mkfifo(file.c_str(), 0600) == 0);
  const int writer = open(file.c_str(), O_RDWR | O_CLOEXEC);
  REQUIRE(writer >= 0);
  std::atomic<bool> written{false};
  std::thread slow([&] {
    while (!written) {
      static_cast<void>(write(writer, "\n", 1) == 1);
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    static_cast<void>(write(writer, "key\n", 4) == 4);
    close(writer);
  });
  daemon.Signal(SIGHUP);
  cell.reset();  // the robot is gone
  const bool reported = daemon.Awaits("robot link lost");
  const bool read_before = daemon.Says("not reloaded");
  written = true;
  slow.join();
  CHECK(reported);
  CHECK_FALSE(read_before);
  CHECK(daemon.Awaits("not reloaded"));
}

TEST_CASE("a large faulty file changes nothing and is refused with its size") {
  RunningCell cell(Idle());
  REQUIRE(cell.Tell("payload 60") == "ok");
  const std::string good = WithPoints(cell.robot(), 2);
  DaemonProcess daemon(good);
  RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
  REQUIRE(Eventually([&] { return Read(plc, 1).valid; }));
  daemon.Write(good + Times(750000, "unknown = 1\n"));
  daemon.Signal(SIGHUP);
  CHECK(daemon.Awaits("not reloaded"));
  CHECK(daemon.Says("it has 9.0 MB, but a configuration file has at most 1 MB"));
  CHECK(Read(plc, 1).valid);
  // Thousands of faults fill neither the log nor its reader's patience.
  std::string faults;
  for (int k = 0; k < 5000; ++k) faults += "\nunknown_" + std::to_string(k) + " = 1";
  daemon.Write(faults + "\n" + good);
  daemon.Signal(SIGHUP);
  CHECK(daemon.Awaits("more faults and warnings are not logged; `plumbline check` prints"));
  CHECK(daemon.Count("unknown_") < 1000);
  CHECK(Read(plc, 1).valid);
}

TEST_CASE("while a reload searches the branches of many points, the daemon responds to signals") {
  RunningCell cell(Idle());
  REQUIRE(cell.Tell("payload 60") == "ok");
  DaemonProcess daemon(WithPoints(cell.robot(), 2));
  RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
  REQUIRE(Eventually([&] { return Read(plc, 1).valid; }));
  SECTION("the old points stay valid until the new ones are prepared") {
    daemon.Write(WithPoints(cell.robot(), kMany));
    daemon.Signal(SIGHUP);
    CHECK(daemon.Awaits("plumbline.toml reloaded"));
    CHECK(Eventually([&] { return Read(plc, kMany - 1).valid; }));
  }
  SECTION("it stops at once") {
    daemon.Write(WithPoints(cell.robot(), 1000));
    daemon.Signal(SIGHUP);
    daemon.Signal(SIGTERM);
    CHECK(daemon.Wait() == 0);
    CHECK_FALSE(daemon.Says("plumbline.toml reloaded"));
  }
  SECTION("a newer file replaces it") {
    daemon.Write(WithPoints(cell.robot(), 1000));
    daemon.Signal(SIGHUP);
    daemon.Write(WithPoints(cell.robot(), 3));
    daemon.Signal(SIGHUP);
    CHECK(daemon.Awaits("plumbline.toml reloaded"));
    CHECK(Eventually([&] { return Read(plc, 2).valid; }));
  }
}

TEST_CASE("a truncated file removes no points on reload; starting without points is a notice") {
  RunningCell cell(Idle());
  REQUIRE(cell.Tell("payload 60") == "ok");
  const std::string good = PatientConfig(cell.robot(), "generic");
  const std::string cut = good.substr(0, good.find("[push]"));
  REQUIRE(cut.size() < good.size());
  {
    DaemonProcess daemon(good);
    RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
    REQUIRE(Eventually([&] { return Read(plc, 0).valid; }));
    daemon.Write(cut);
    daemon.Signal(SIGHUP);
    CHECK(daemon.Awaits("point: the file has no [[point]], but 2 points are in force"));
    CHECK(daemon.Awaits("Configuration not reloaded"));
    CHECK(Read(plc, 0).valid);
  }
  DaemonProcess daemon(cut);
  RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
  CHECK(Eventually([&] {
    return plc.Read(24, 2).Word(1) == static_cast<int>(plumbline::HealthReason::kNoPoints);
  }));
  CHECK(plc.Read(24, 2).Word(0) == static_cast<int>(plumbline::HealthSeverity::kNotice));
}

TEST_CASE("a too deeply nested file is a fault with its line; the running daemon continues") {
  RunningCell cell(Idle());
  REQUIRE(cell.Tell("payload 60") == "ok");
  const std::string good = PatientConfig(cell.robot(), "generic");
  DaemonProcess daemon(good);
  RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
  REQUIRE(Eventually([&] { return Read(plc, 0).valid; }));
  daemon.Write("\n[" + Times(100'000, "a.") + "a]\n" + good);
  daemon.Signal(SIGHUP);
  CHECK(daemon.Awaits("plumbline.toml:2: nested more than 32 levels deep"));
  CHECK(daemon.Awaits("Configuration not reloaded"));
  const std::string hostile = daemon.folder() + "/cell.toml";
  std::ofstream(hostile) << "a = " << Times(100'000, "[");
  daemon.Write(WithLine(good, "", "cell", "\"" + hostile + "\""));
  daemon.Signal(SIGHUP);
  CHECK(daemon.Awaits("cell.toml:1: nested more than 32 levels deep"));
  CHECK(Read(plc, 0).valid);
  daemon.Write(good);
  daemon.Signal(SIGHUP);
  CHECK(daemon.Awaits("plumbline.toml reloaded"));
}

TEST_CASE(
    "10,000 connections and a full accept queue leave the robot's link and the points alone") {
  RunningCell cell(Idle());
  REQUIRE(cell.Tell("payload 60") == "ok");
  DaemonProcess daemon(PatientConfig(cell.robot(), "generic"));
  const std::string plc_at = daemon.Plc();
  RegisterClient plc("plumblined", plc_at, 1, 10);
  REQUIRE(Eventually([&] { return Read(plc, 0).valid; }));
  Flood flood(plc_at, 500);
  for (int k = 0; k < 200; ++k) {
    flood.Begin(50);
    REQUIRE(Read(plc, 0).valid);
  }
  CHECK_FALSE(daemon.Says("robot link lost"));
}

TEST_CASE("clients never use up the descriptor that the robot link needs to reconnect") {
  RunningCell cell(Idle());
  REQUIRE(cell.Tell("payload 60") == "ok");
  DaemonProcess daemon(DemoConfig(cell.robot(), "generic"), std::nullopt, [] {
    const rlimit few{.rlim_cur = 48, .rlim_max = 48};
    setrlimit(RLIMIT_NOFILE, &few);
  });
  const std::string plc_at = daemon.Plc();
  CHECK(daemon.Says("Raise LimitNOFILE"));
  {
    RegisterClient plc("plumblined", plc_at, 1, 10);
    REQUIRE(Eventually([&] { return Read(plc, 0).valid; }));
  }
  Flood flood(plc_at, 100);
  flood.Begin(100);
  REQUIRE(cell.Tell("fault stall 1.5") == "ok");
  CHECK(daemon.Awaits("robot link lost"));
  const bool restored = daemon.Awaits("robot link restored after");
  INFO(daemon.Log());
  CHECK(restored);
  RegisterClient plc("plumblined", plc_at, 1, 10);
  CHECK(Eventually([&] { return Read(plc, 0).valid; }));
}

TEST_CASE("the configuration can be given with --config and without") {
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/faulty.toml", log = folder.path() + "/log";
  std::ofstream(file) << "schema = 1\nno_such_key = 3\n";
  for (const char* option : {"", "--config "}) {
    CAPTURE(option);
    const std::string command =
        std::string(PLUMBLINED) + " " + option + file + " > " + log + " 2>&1";
    const int status = std::system(command.c_str());
    REQUIRE(WIFEXITED(status));
    INFO(FileText(log));
    CHECK(WEXITSTATUS(status) == 1);
    CHECK(FileText(log).find("faulty.toml") != std::string::npos);  // it was read
  }
}

}  // namespace plumbline::start_test
