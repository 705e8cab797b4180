// State directories that cannot be written: full, read-only. Uses a separate file system in the
// daemon's mount namespace.
#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "app/cell/daemon/state_storage.h"
#include "tests/app/cell/daemon/daemon_process.h"
#include "tests/app/cell/daemon/demo_config.h"
#include "tests/virtual_cell/running_cell.h"

namespace plumbline::storage_test {

using namespace plumbline::cell;
using namespace plumbline::test;
using virtual_cell::Eventually;
using virtual_cell::Profile;
using virtual_cell::RegisterClient;
using virtual_cell::RunningCell;
using virtual_cell::VirtualCellOptions;

namespace {

constexpr std::uint16_t kStorageWarning = 1 << 14;
constexpr int kStorageCode = 19;
constexpr const char* kBallast = "/ballast";

/// Mounts a small file system at `folder`, visible only to the calling process.
bool MountSmall(const std::string& folder) {
  return unshare(CLONE_NEWNS) == 0 &&
         mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
         mount("small", folder.c_str(), "tmpfs", 0, "size=1m") == 0;
}

void FillUp(const std::string& folder) {
  const int fd = open((folder + kBallast).c_str(), O_WRONLY | O_CREAT, 0600);
  const std::string zeros(4096, 'x');
  while (write(fd, zeros.data(), zeros.size()) > 0) {
  }
  close(fd);
}

/// Uses up all inodes, but not all bytes.
void UseUpInodes(const std::string& folder) {
  std::filesystem::create_directory(folder + kBallast);
  for (int k = 0; k < 1000; ++k) {
    const std::string file = fmt::format("{}{}/{}", folder, kBallast, k);
    const int fd = open(file.c_str(), O_WRONLY | O_CREAT, 0600);
    if (fd < 0) return;
    close(fd);
  }
}

bool MayMount() {
  const TemporaryFolder folder;
  const pid_t child = fork();
  if (child == 0) _exit(MountSmall(folder.path()) ? 0 : 1);
  int status = 1;
  waitpid(child, &status, 0);
  if (status != 0) WARN("SKIPPED: no mount namespace may be made here (not root)");
  return status == 0;
}

VirtualCellOptions Idle() {
  return {.profile = Profile::kUr, .idle = true, .time_scale = 4};
}

struct Station {
  RunningCell cell{Idle()};
  TemporaryFolder mount_point;
  DaemonProcess daemon;
  RegisterClient plc;
  std::uint16_t sequence = 10;

  /// @param prepare  runs in the daemon's namespace before it starts
  explicit Station(const std::function<void(const std::string& folder)>& prepare)
      : daemon(WithLine(DemoConfig(cell.robot(), "universal-robots-fine"), "", "state_directory",
                        "\"" + mount_point.path() + "\"") +
                   "\n[monitoring]\nenabled = true\nsession = \"day 1\"\n",
               std::nullopt,
               [this, &prepare] {
                 if (!MountSmall(mount_point.path())) _exit(126);
                 prepare(mount_point.path());
               }),
        plc("plumblined", daemon.Plc(), 1, 10) {
    REQUIRE(cell.Tell("payload 60") == "ok");
  }

  /// The mount point as the daemon sees it.
  std::string Inside(const std::string& file = "") const {
    return fmt::format("/proc/{}/root{}{}", daemon.pid(), mount_point.path(), file);
  }
  bool Warned() { return (plc.Read(14, 1).Word(0) & kStorageWarning) != 0; }
  bool PointValid() { return (plc.Read(2000, 20).Word(1) & 1) != 0; }

  /// Submits the predicted tip as a probe. @return  its result code
  int Probe() {
    std::vector<std::uint16_t> words = {6, 0};
    const auto reported = plc.Read(318, 6);  // the unloaded tip, which is near enough
    for (const std::uint16_t word :
         virtual_cell::WordsFromFloats({reported.Float(0), reported.Float(2), reported.Float(4)})) {
      words.push_back(word);
    }
    words.resize(40);
    words[39] = ++sequence;
    plc.Write(1000, words);
    INFO(daemon.Log());
    REQUIRE(Eventually([&] { return plc.Read(100, 40).Word(1) == sequence; }));
    return plc.Read(100, 40).Word(2);
  }
};

}  // namespace

TEST_CASE("the reason why a directory cannot be written includes a remedy") {
  const TemporaryFolder folder;
  CHECK_FALSE(StorageFault(folder.path() + "/made/on/the/way"));
  const auto no_folder = StorageFault("/proc/none");
  REQUIRE(no_folder);
  CHECK_THAT(*no_folder, Catch::StartsWith("/proc/none: ") && Catch::Contains("; "));
}

TEST_CASE("a start on a full disk serves the points, refuses probes, and recovers by itself") {
  if (!MayMount()) return;
  Station station(FillUp);
  INFO(station.daemon.Log());
  REQUIRE(Eventually([&] { return station.PointValid(); }));
  CHECK(Eventually([&] { return station.Warned(); }));
  CHECK(station.Probe() == kStorageCode);
  CHECK(station.daemon.Says("No space left on device; make room on its disk"));
  CHECK_FALSE(station.daemon.Says("not started"));

  std::filesystem::remove(station.Inside(kBallast));
  CHECK(station.daemon.Awaits("state directory can be written again"));
  CHECK(Eventually([&] { return !station.Warned(); }));
  REQUIRE(Eventually([&] { return (station.plc.Read(400, 1).Word(0) & 1) != 0; }));
  CHECK(station.Probe() == 0);
  CHECK(station.PointValid());
  CHECK(FileText(station.Inside("/boot_count")) == "1\n");
  // Models are stored again, too: the cell file is version 1.
  CHECK(Eventually([&] { return station.plc.Read(400, 20).Word(1) == 1; }));
  CHECK(std::filesystem::exists(station.Inside("/view.socket")));
}

TEST_CASE("a start on a read-only disk serves the points, and recovers once it is writable") {
  if (!MayMount()) return;
  Station station([](const std::string& folder) {
    if (mount("small", folder.c_str(), "tmpfs", MS_REMOUNT | MS_RDONLY, nullptr) != 0) _exit(124);
  });
  INFO(station.daemon.Log());
  REQUIRE(Eventually([&] { return station.PointValid(); }));
  CHECK(Eventually([&] { return station.Warned(); }));
  CHECK(station.Probe() == kStorageCode);
  CHECK(station.daemon.Says("Read-only file system; its file system is read-only"));

  const std::string again = fmt::format("nsenter -t {} -m mount -o remount,rw {}",
                                        station.daemon.pid(), station.mount_point.path());
  REQUIRE(std::system(again.c_str()) == 0);
  CHECK(station.daemon.Awaits("state directory can be written again"));
  REQUIRE(Eventually([&] { return (station.plc.Read(400, 1).Word(0) & 1) != 0; }));
  CHECK(station.Probe() == 0);
}

TEST_CASE("a disk that fills up while the daemon runs: the next probes are refused, none is lost") {
  if (!MayMount()) return;
  Station station([](const std::string&) {});
  REQUIRE(Eventually([&] { return (station.plc.Read(400, 1).Word(0) & 1) != 0; }));
  REQUIRE(Eventually([&] { return station.PointValid(); }));
  REQUIRE(Eventually([&] { return station.plc.Read(330, 2).Float(0) == 60; }));
  REQUIRE(station.Probe() == 0);
  FillUp(station.Inside());
  CHECK(Eventually([&] { return station.Warned(); }));
  CHECK(station.Probe() == kStorageCode);
  CHECK(station.PointValid());
  std::filesystem::remove(station.Inside(kBallast));
  CHECK(Eventually([&] { return !station.Warned(); }));
  REQUIRE(Eventually([&] { return (station.plc.Read(400, 1).Word(0) & 1) != 0; }));
  CHECK(station.Probe() == 0);
}

TEST_CASE("a disk without a free inode is reported, though it has room for bytes") {
  if (!MayMount()) return;
  Station station([](const std::string& folder) {
    if (mount("small", folder.c_str(), "tmpfs", MS_REMOUNT, "nr_inodes=100") != 0) _exit(124);
  });
  REQUIRE(Eventually([&] { return station.PointValid(); }));
  REQUIRE_FALSE(station.Warned());
  UseUpInodes(station.Inside());
  CHECK(Eventually([&] { return station.Warned(); }));
  CHECK(station.Probe() == kStorageCode);
  CHECK(station.PointValid());
  std::filesystem::remove_all(station.Inside(kBallast));
  CHECK(Eventually([&] { return !station.Warned(); }));
}

}  // namespace plumbline::storage_test
