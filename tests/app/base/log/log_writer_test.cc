// A receiver of log lines may hang; the writer never blocks.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <string>
#include <vector>

#include "app/base/log/log.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::log_writer_test {

using namespace plumbline::log;
using test::TemporaryFolder;

namespace {

/// journald's end of its socket.
class Journald {
 public:
  explicit Journald(const std::string& path) : fd_(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    REQUIRE(bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }
  ~Journald() { close(fd_); }
  Journald(const Journald&) = delete;
  Journald& operator=(const Journald&) = delete;

  std::vector<std::string> Take() const {
    std::vector<std::string> lines;
    std::array<char, 4096> text;
    ssize_t size = 0;
    while ((size = recv(fd_, text.data(), text.size(), MSG_DONTWAIT)) >= 0) {
      lines.emplace_back(text.data(), static_cast<std::size_t>(size));
    }
    return lines;
  }

 private:
  int fd_;
};

struct Pipe {
  Pipe() { REQUIRE(pipe2(ends.data(), O_CLOEXEC) == 0); }
  ~Pipe() {
    for (const int end : ends) {
      if (end >= 0) close(end);
    }
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  std::string Take() const {
    fcntl(ends[0], F_SETFL, O_NONBLOCK);
    std::string all;
    std::array<char, 65536> text;
    ssize_t size = 0;
    while ((size = read(ends[0], text.data(), text.size())) > 0) {
      all.append(text.data(), static_cast<std::size_t>(size));
    }
    return all;
  }
  std::array<int, 2> ends{-1, -1};
};

LogWriter::Line LineOf(int number) {
  return {fmt::format("MESSAGE={}\n", number), fmt::format("{}\n", number)};
}

}  // namespace

TEST_CASE("a journald that hangs blocks nobody; the newest lines follow when it is back") {
  const TemporaryFolder folder;
  const Journald journald(folder.path() + "/socket");
  LogWriter writer(folder.path() + "/socket", -1);
  constexpr int kLines = 2000;
  for (int k = 0; k < kLines; ++k) writer.Put(LineOf(k), 10);
  CHECK_FALSE(writer.TakeBlockage());

  std::vector<std::string> taken;
  for (bool more = true; more;) {  // its queue holds fewer lines than are buffered
    const std::vector<std::string> some = journald.Take();
    taken.insert(taken.end(), some.begin(), some.end());
    writer.Flush(17);
    more = !some.empty();
  }
  const auto blockage = writer.TakeBlockage();
  REQUIRE(blockage);
  CHECK(blockage->duration_s == Approx(7));
  CHECK(blockage->late == LogWriter::kMaxBuffered);
  CHECK(blockage->lost == kLines - taken.size());
  REQUIRE(taken.size() > LogWriter::kMaxBuffered);
  const std::size_t at_once = taken.size() - LogWriter::kMaxBuffered;
  for (std::size_t k = 0; k < taken.size(); ++k) {
    const std::size_t number = k < at_once ? k : kLines - taken.size() + k;
    REQUIRE(taken[k] == fmt::format("MESSAGE={}\n", number));
  }
  CHECK_FALSE(writer.TakeBlockage());
  writer.Put(LineOf(5), 18);
  CHECK(journald.Take() == std::vector<std::string>{"MESSAGE=5\n"});
  CHECK_FALSE(writer.TakeBlockage());
}

TEST_CASE("without a journald the lines go to the descriptor") {
  const TemporaryFolder folder;
  const Pipe error;
  LogWriter writer(folder.path() + "/nobody", error.ends[1]);
  writer.Put(LineOf(1), 0);
  CHECK(error.Take() == "1\n");
  const Journald journald(folder.path() + "/nobody");  // used again as soon as it exists
  writer.Put(LineOf(2), 0);
  CHECK(error.Take().empty());
  CHECK(journald.Take() == std::vector<std::string>{"MESSAGE=2\n"});
}

TEST_CASE("a pipe that nobody reads blocks nobody, and no line is truncated") {
  const Pipe error;
  LogWriter writer("", error.ends[1]);
  const std::string line = std::string(9999, 'x') + '\n';
  for (int k = 0; k < 1000; ++k) writer.Put({"", line}, 3);
  std::string taken;
  for (bool more = true; more;) {
    const std::string some = error.Take();
    taken += some;
    writer.Flush(4);
    more = !some.empty();
  }
  const auto blockage = writer.TakeBlockage();
  REQUIRE(blockage);
  CHECK(blockage->lost > 0);
  REQUIRE(taken.size() == line.size() * (1000 - blockage->lost));
  for (std::size_t at = 0; at < taken.size(); at += line.size()) {
    REQUIRE(taken.compare(at, line.size(), line) == 0);
  }
}

TEST_CASE("a stopped terminal takes some bytes, and then blocks nobody") {
  const int master = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  REQUIRE(master >= 0);
  REQUIRE(grantpt(master) == 0);
  REQUIRE(unlockpt(master) == 0);
  const int terminal = open(ptsname(master), O_RDWR | O_NOCTTY | O_CLOEXEC);
  REQUIRE(terminal >= 0);
  constexpr int kLines = 2000;
  {
    LogWriter writer("", terminal);
    for (int k = 0; k < kLines; ++k) writer.Put({"", fmt::format("{:0300}\n", k)}, 0.01 * k);
    std::array<char, 4096> text;
    fcntl(master, F_SETFL, O_NONBLOCK);
    for (int k = 0; k < kLines; ++k) {
      while (read(master, text.data(), text.size()) > 0) {
      }
      writer.Flush(100);
    }
    const auto blockage = writer.TakeBlockage();
    REQUIRE(blockage);
    CHECK(blockage->lost > 0);
    CHECK(blockage->lost < kLines);
  }
  CHECK((fcntl(terminal, F_GETFL) & O_NONBLOCK) == 0);  // not changed for those who share it
  close(terminal);
  close(master);
}

TEST_CASE("a line that nobody will ever read is not buffered") {
  Pipe error;
  close(std::exchange(error.ends[0], -1));
  LogWriter writer("", error.ends[1]);
  writer.Put(LineOf(1), 0);
  writer.Flush(9);
  CHECK_FALSE(writer.TakeBlockage());
}

}  // namespace plumbline::log_writer_test
