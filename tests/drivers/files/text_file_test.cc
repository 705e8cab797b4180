#include "drivers/files/text_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <fstream>
#include <thread>

#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"

namespace plumbline::text_file_test {

using namespace plumbline::files;
using plumbline::test::FileText;
using plumbline::test::TemporaryFolder;

TEST_CASE("a pipe is read to its end, and waits for nobody") {
  const TemporaryFolder folder;
  const std::string pipe = folder.path() + "/pipe";
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  const auto without_writer = ReadTextFile(pipe);
  REQUIRE(without_writer);
  CHECK(without_writer->empty());

  const int writer = open(pipe.c_str(), O_RDWR | O_CLOEXEC);
  REQUIRE(writer >= 0);
  const auto silent = ReadTextFile(pipe);
  REQUIRE_FALSE(silent);
  CHECK(silent.error() ==
        "is a pipe that delivered no data for 1.5 s; check the program that writes to it");

  std::thread late([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    const int other = open(pipe.c_str(), O_WRONLY | O_CLOEXEC);
    static_cast<void>(write(other, "schema = 1\n", 11) == 11);
    close(other);
    close(writer);
  });
  const auto whole = ReadTextFile(pipe);
  late.join();
  REQUIRE(whole);
  CHECK(*whole == "schema = 1\n");
}

TEST_CASE("a file above its limit is refused with its size, the limit and a remedy") {
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/cell.toml";
  const auto write = [&file](std::size_t bytes) { std::ofstream(file) << std::string(bytes, '#'); };
  write(kConfigurationSize.bytes);
  CHECK(ReadTextFile(file));
  write(kConfigurationSize.bytes + 1);
  CHECK_FALSE(ReadTextFile(file));
  write(9'000'000);
  const auto large = ReadTextFile(file);
  REQUIRE_FALSE(large);
  CHECK(large.error() ==
        "it has 9.0 MB, but a configuration file has at most 1 MB. Check that this is the right "
        "file, and that no program has appended to it");
  CHECK(ReadFileUpTo(kTableSize, file));
  // The size of a pipe is not known before it is read.
  const std::string pipe = folder.path() + "/pipe";
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  const int writer = open(pipe.c_str(), O_RDWR | O_CLOEXEC);
  std::thread endless([writer] {
    const std::string text(65536, '#');
    for (int k = 0; k < 15; ++k) {
      if (::write(writer, text.data(), text.size()) < 0) return;
    }
    static_cast<void>(::write(writer, text.data(), text.size() / 2) > 0);
  });
  const auto endless_read = ReadTextFile(pipe);
  endless.join();
  close(writer);
  REQUIRE_FALSE(endless_read);
  CHECK_THAT(endless_read.error(), Catch::StartsWith("it has more than 1 MB"));
}

TEST_CASE("standard output that is a file keeps what others write to it") {
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/out";
  const int kept = dup(STDOUT_FILENO);
  const int out = open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  REQUIRE(write(out, "before\n", 7) == 7);
  dup2(out, STDOUT_FILENO);
  const auto written = WriteTextFile("/dev/stdout", "text\n");
  const bool after = write(STDOUT_FILENO, "after\n", 6) == 6;
  dup2(kept, STDOUT_FILENO);
  close(kept);
  close(out);
  CHECK(written);
  CHECK(after);
  CHECK(FileText(file) == "before\ntext\nafter\n");
}

}  // namespace plumbline::text_file_test
