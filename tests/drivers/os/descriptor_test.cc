// Owning file descriptors, and durable file writes.
#include "drivers/os/descriptor.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "drivers/os/file_writing.h"

namespace plumbline::descriptor_test {

using plumbline::os::Descriptor;

namespace {

bool IsOpen(int fd) {
  return fcntl(fd, F_GETFD) != -1;
}

Descriptor Opened() {
  Descriptor descriptor(open("/dev/null", O_RDWR | O_CLOEXEC));
  REQUIRE(descriptor);
  return descriptor;
}

struct Folder {
  std::string path = "/tmp/plumbline-os-XXXXXX";
  Folder() { REQUIRE(mkdtemp(path.data()) != nullptr); }
  ~Folder() { std::filesystem::remove_all(path); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
};

}  // namespace

TEST_CASE("a descriptor is closed once, by its last owner", "[os]") {
  int fd = -1;
  {
    Descriptor first = Opened();
    fd = first.get();
    Descriptor second = std::move(first);
    CHECK(second.get() == fd);
    first = std::move(second);
    CHECK_FALSE(second);
    CHECK(first.get() == fd);
    CHECK(IsOpen(fd));
  }
  CHECK_FALSE(IsOpen(fd));
}

TEST_CASE("Reset() closes the descriptor owned before", "[os]") {
  Descriptor owner = Opened();
  const int before = owner.get();
  Descriptor other = Opened();
  const int after = other.get();
  owner = std::move(other);
  CHECK(owner.get() == after);
  CHECK_FALSE(IsOpen(before));
  owner.Reset();
  CHECK_FALSE(owner);
  CHECK_FALSE(IsOpen(after));
}

TEST_CASE("a released descriptor stays open", "[os]") {
  int fd = -1;
  {
    Descriptor owner = Opened();
    fd = owner.Release();
    CHECK(owner.get() == -1);
  }
  CHECK(IsOpen(fd));
  const Descriptor again(fd);
}

TEST_CASE("a failed call yields no descriptor, and closing preserves errno", "[os]") {
  const Descriptor missing(open("/nonexistent/file", O_RDONLY | O_CLOEXEC));
  CHECK_FALSE(missing);
  CHECK(missing.get() == -1);
  errno = ENOSPC;
  {
    Descriptor damaged(1 << 20);  // never open: close() fails
    CHECK(damaged.get() == 1 << 20);
  }
  CHECK(errno == ENOSPC);
  CHECK_FALSE(Descriptor(1 << 20).CloseWritten());
  CHECK(errno == EBADF);
}

TEST_CASE("descriptors live in vectors", "[os]") {
  std::vector<int> numbers;
  {
    std::vector<Descriptor> all;
    for (int k = 0; k < 20; ++k) {
      all.push_back(Opened());
      numbers.push_back(all.back().get());
    }
    all.erase(all.begin() + 3);
    CHECK_FALSE(IsOpen(numbers[3]));
    CHECK(IsOpen(numbers[4]));
  }
  for (const int fd : numbers) CHECK_FALSE(IsOpen(fd));
}

TEST_CASE("a text is written completely and synced; a missing file or full disk is an error",
          "[os]") {
  const Folder folder;
  const std::string path = folder.path + "/file";
  const std::string text(300'000, 'x');
  Descriptor file(open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600));
  REQUIRE(file);
  CHECK(plumbline::os::WriteAll(file.get(), text));
  CHECK(file.CloseWritten());
  CHECK(plumbline::os::SyncFile(path));
  CHECK(plumbline::os::SyncFolder(folder.path));
  std::ostringstream read;
  read << std::ifstream(path).rdbuf();
  CHECK(read.str() == text);

  const Descriptor full(open("/dev/full", O_WRONLY | O_CLOEXEC));
  CHECK_FALSE(plumbline::os::WriteAll(full.get(), text));
  CHECK(errno == ENOSPC);
  CHECK_FALSE(plumbline::os::SyncFile(folder.path + "/none"));
  CHECK(errno == ENOENT);
  CHECK_FALSE(plumbline::os::SyncFolder(path));
  CHECK(errno == ENOTDIR);
}

}  // namespace plumbline::descriptor_test
