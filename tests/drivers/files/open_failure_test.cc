#include "drivers/files/open_failure.h"

#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "tests/app/temporary_folder.h"

namespace plumbline::open_failure_test {

using namespace plumbline::files;
using plumbline::test::TemporaryFolder;

namespace {

constexpr uid_t kNobody = 65534;

/// Switches to an unprivileged user while it exists; requires root.
class AsNobody {
 public:
  AsNobody() : is_(geteuid() == 0 && seteuid(kNobody) == 0) {}
  ~AsNobody() {
    if (is_) static_cast<void>(seteuid(0) == 0);
  }
  AsNobody(const AsNobody&) = delete;
  AsNobody& operator=(const AsNobody&) = delete;
  bool is() const { return is_; }

 private:
  bool is_;
};

}  // namespace

TEST_CASE("read errors name the missing folder, or the folder to list") {
  const TemporaryFolder folder;
  const std::string at = folder.path();
  CHECK(ReadErrorText(at + "/cells/ur10.toml", std::strerror(ENOENT)) ==
        "cannot be read: No such file or directory; there is no folder " + at +
            "/cells: check the path");
  CHECK(ReadErrorText(at + "/ur10.toml", std::strerror(ENOENT)) ==
        "cannot be read: No such file or directory; check the name: ls " + at);
  CHECK(ReadRemedy("no-such-file.toml") ==
        "; check the name: ls " + std::filesystem::current_path().string());
  CHECK(ReadErrorText(at, std::strerror(EISDIR)) ==
        "cannot be read: Is a directory; it is a folder: name a file in it");
  std::ofstream(at + "/file") << "x";
  CHECK(ReadRemedy(at + "/file/cell.toml") == "; " + at + "/file is not a folder: check the path");
  CHECK(ReadErrorText(at + "/file", std::strerror(ENOTDIR)) ==
        "cannot be read: Not a directory; it is not a folder: name a folder");
  CHECK(ReadRemedy(at + "/file").empty());
  std::filesystem::create_symlink("gone.toml", at + "/link");
  CHECK(ReadRemedy(at + "/link") == "; it is a link to gone.toml, which does not exist");
  CHECK(
      ReadErrorText(at + "/file", std::strerror(EIO)) ==
      "cannot be read: Input/output error; the disk or share reports an error: see journalctl -k");
}

TEST_CASE("permission errors name the owner and how to get access") {
  const TemporaryFolder folder;
  const std::string at = folder.path(), file = at + "/cell.toml";
  std::ofstream(file) << "x";
  chmod(at.c_str(), 0755);
  chmod(file.c_str(), 0600);
  if (geteuid() != 0) {
    WARN("SKIPPED: only root can be another user");
    return;
  }
  {
    const AsNobody nobody;
    REQUIRE(nobody.is());
    CHECK(ReadErrorText(file, std::strerror(EACCES)) ==
          "cannot be read: Permission denied; " + file +
              " (root:root 600) may not be read by user nobody: change its mode or owner, or use "
              "sudo");
    CHECK(WriteErrorText(at + "/new.csv", std::strerror(EACCES)) ==
          "cannot be written: Permission denied; " + at +
              " (root:root 755) may not be written by user nobody: change its mode or owner, or "
              "use sudo");
  }
  constexpr gid_t kDialout = 20;  // the same on every Debian
  REQUIRE(chown(file.c_str(), 0, kDialout) == 0);
  chmod(file.c_str(), 0640);
  {
    const AsNobody nobody;
    CHECK(ReadRemedy(file) == "; " + file +
                                  " (root:dialout 640) may not be read by user nobody: sudo "
                                  "usermod -aG dialout nobody, then log in again, or use sudo");
  }
  chmod(at.c_str(), 0700);
  {
    const AsNobody nobody;
    CHECK(ReadRemedy(file) == "; " + at +
                                  " (root:root 700) may not be entered by user nobody: change its "
                                  "mode or owner, or use sudo");
  }
}

TEST_CASE("write errors: a folder in its place, a missing folder, a full disk") {
  const TemporaryFolder folder;
  CHECK(WriteRemedy(folder.path()) == "; it is a folder: name a file in it");
  CHECK(WriteRemedy(folder.path() + "/out/a.csv") ==
        "; there is no folder " + folder.path() + "/out: check the path");
  CHECK(WriteRemedy(folder.path() + "/a.csv").empty());
  CHECK(WriteErrorText(folder.path() + "/a.csv", std::strerror(ENOSPC)) ==
        "cannot be written: No space left on device; the disk is full: free space (df -h)");
}

TEST_CASE("every reason why a device cannot be opened has a remedy") {
  CHECK(OpenErrorText(ENOENT, kSerialLine) ==
        "cannot be opened: No such file or directory; is the adapter plugged in, and is this its "
        "name (ls /dev/serial/by-id)?");
  CHECK(OpenErrorText(EBUSY, kCameraDevice) ==
        "cannot be opened: Device or resource busy; another program uses it: close that program");
  CHECK(OpenErrorText(ENOTTY, kSerialLine) ==
        "cannot be opened: Inappropriate ioctl for device; it is not a serial line");
  for (const DeviceKind& kind : {kSerialLine, kCameraDevice, kDisplayDevice, kGpioChip}) {
    for (const int error : {ENOENT, ENODEV, ENXIO, EACCES, EPERM, EBUSY, ENOTTY, EIO, EMFILE}) {
      const std::string text = OpenErrorText(error, kind);
      CHECK_THAT(text, Catch::Contains("; ") && !Catch::EndsWith("; "));
      if (error == EACCES)
        CHECK_THAT(text, Catch::Contains("in the group") && Catch::Contains(kind.group));
    }
  }
}

}  // namespace plumbline::open_failure_test
