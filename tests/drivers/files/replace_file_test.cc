#include "drivers/files/replace_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"

namespace plumbline::replace_file_test {

using namespace plumbline::files;
using plumbline::test::FileText;
using plumbline::test::TemporaryFolder;
namespace fs = std::filesystem;

namespace {

std::size_t FilesIn(const std::string& folder) {
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder)) ++files;
  return files;
}

}  // namespace

TEST_CASE("of several files none is replaced if one cannot be written") {
  const TemporaryFolder folder;
  const std::string first = folder.path() + "/a", second = folder.path() + "/b";
  std::ofstream(first) << "old";
  const std::vector<NewFile> files = {{first, "new"}, {second, "new"}};
  fs::create_directory(second);
  const Result<void> failed = ReplaceFiles(files);
  REQUIRE_FALSE(failed);
  CHECK(failed.error() == second + ": is a folder");
  CHECK(FileText(first) == "old");
  CHECK(FilesIn(folder.path()) == 2);
  fs::remove(second);
  CHECK(ReplaceFiles(files));
  CHECK(FileText(first) == "new");
  CHECK(FileText(second) == "new");
  CHECK(FilesIn(folder.path()) == 2);
}

TEST_CASE("a replaced file takes the place of a link, and never writes through it") {
  const TemporaryFolder folder;
  const std::string victim = folder.path() + "/victim", link = folder.path() + "/state";
  std::ofstream(victim) << "precious";
  const auto replace = GENERATE(
      +[](const std::string& path) { return ReplaceFile(path, "ours"); },
      +[](const std::string& path) { return ReplaceFileDurably(path, "ours"); });
  REQUIRE(symlink(victim.c_str(), link.c_str()) == 0);
  CHECK(replace(link));
  CHECK(FileText(victim) == "precious");
  CHECK(FileText(link) == "ours");
  CHECK_FALSE(fs::is_symlink(link));
  CHECK(FilesIn(folder.path()) == 2);
}

TEST_CASE("a failed replacement leaves the old file and no temporary one") {
  const TemporaryFolder folder;
  const std::string in_the_way = folder.path() + "/state";
  fs::create_directories(in_the_way + "/kept");
  const auto reason = ReplaceFile(in_the_way, "new");
  REQUIRE_FALSE(reason);
  CHECK(reason.error() == "Is a directory");
  const auto message = ReplaceFileDurably(in_the_way, "new");
  REQUIRE_FALSE(message);
  CHECK(message.error() == in_the_way +
                               ": cannot be written: Is a directory; it is a folder: name a file "
                               "in it");
  CHECK(fs::exists(in_the_way + "/kept"));
  CHECK(FilesIn(folder.path()) == 1);

  const std::string absent = folder.path() + "/absent/state";
  CHECK(ReplaceFile(absent, "new").error() == "No such file or directory");
  CHECK(ReplaceFileDurably(absent, "new").error() ==
        absent + ": cannot be written: No such file or directory; there is no folder " +
            folder.path() + "/absent: check the path");
}

TEST_CASE("a durable replacement clears up what an interrupted one left") {
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/0001.toml";
  std::ofstream(file + ".new") << "half";
  chmod((file + ".new").c_str(), 0444);
  REQUIRE(ReplaceFileDurably(file, "whole", 0444));
  CHECK(FileText(file) == "whole");
  CHECK(FilesIn(folder.path()) == 1);
  struct stat about {};
  REQUIRE(stat(file.c_str(), &about) == 0);
  CHECK((about.st_mode & 0777) == 0444);
}

TEST_CASE("simultaneous writers never mix their contents") {
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/picture";
  std::vector<std::thread> writers;
  for (const char letter : {'a', 'b', 'c', 'd'}) {
    writers.emplace_back([&file, letter] {
      for (int i = 0; i < 20; ++i) static_cast<void>(ReplaceFile(file, std::string(5000, letter)));
    });
  }
  for (std::thread& writer : writers) writer.join();
  const std::string text = FileText(file);
  REQUIRE(text.size() == 5000);
  CHECK(text == std::string(5000, text[0]));
  CHECK(FilesIn(folder.path()) == 1);
}

}  // namespace plumbline::replace_file_test
