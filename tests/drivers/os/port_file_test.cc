// Port files: content, replacement at once, refusal.
#include "drivers/os/port_file.h"

#include <catch2/catch.hpp>
#include <filesystem>

#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"
#include "tests/port_file.h"

namespace plumbline::os::port_file_test {

TEST_CASE("a port file has one line per server, and is replaced as a whole") {
  const test::TemporaryFolder folder;
  const std::string file = folder.path() + "/ports";
  REQUIRE(WritePortFile(file, {{"plc", 1502}, {"page", 8080}}));
  CHECK(test::FileText(file) == "plc 1502\npage 8080\n");
  CHECK(test::PortIn(file, "page") == 8080);
  CHECK(test::PortIn(file, "robot") == 0);
  // A reader keeps what it has opened; a new one gets the new content.
  std::ifstream reader(file);
  REQUIRE(WritePortFile(file, {{"plc", 7}}));
  std::string name;
  int port = 0;
  CHECK(reader >> name >> port);
  CHECK(port == 1502);
  CHECK(test::PortIn(file, "plc") == 7);
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
}

TEST_CASE("a port file that cannot be written is named, with a remedy") {
  const auto written = WritePortFile("/nonexistent/ports", {{"plc", 1}});
  REQUIRE_FALSE(written);
  CHECK_THAT(written.error(), Catch::StartsWith("/nonexistent/ports: the port cannot be written"));
  CHECK_THAT(written.error(), Catch::Contains("name a file in a folder that exists"));
}

}  // namespace plumbline::os::port_file_test
