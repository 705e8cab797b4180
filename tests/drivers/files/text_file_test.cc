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
