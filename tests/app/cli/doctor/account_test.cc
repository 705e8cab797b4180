#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <fstream>

#include "app/cli/doctor/examine.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::account_test {

using namespace plumbline::cli;
using test::TemporaryFolder;

namespace {

constexpr uid_t kSomeone = 54321;
constexpr gid_t kTheirGroup = 54322;
const Account kService{"service", kSomeone, {kTheirGroup}};

}  // namespace

TEST_CASE("permissions follow owner, group and others of the file and all its parent directories") {
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/device";
  std::ofstream(file) << "x";
  chmod(folder.path().c_str(), 0755);
  chmod(file.c_str(), 0664);
  CHECK(AccessProblem(kService, file, false).empty());
  CHECK_THAT(AccessProblem(kService, file, true),
             Catch::EndsWith("664) may not be read and written by service"));
  chmod(file.c_str(), 0640);
  CHECK_THAT(AccessProblem(kService, file, false),
             Catch::EndsWith("640) may not be read by service"));
  if (geteuid() == 0) {  // only root may give a file away
    REQUIRE(chown(file.c_str(), 0, kTheirGroup) == 0);
    CHECK(AccessProblem(kService, file, false).empty());
    REQUIRE(chown(file.c_str(), kSomeone, 0) == 0);
    CHECK(AccessProblem(kService, file, true).empty());
  }
  chmod(file.c_str(), 0666);
  chmod(folder.path().c_str(), 0700);
  CHECK_THAT(AccessProblem(kService, file, false),
             Catch::EndsWith("700) may not be entered by service"));
  CHECK(AccessProblem({"root", 0, {}}, file, true).empty());
  CHECK_THAT(AccessProblem(kService, "/nonexistent/device", false),
             Catch::EndsWith("/nonexistent: No such file or directory"));
}

TEST_CASE("an unknown user name stands for the calling user") {
  CHECK(AccountByName("no-such-user-here").user == geteuid());
  CHECK(AccountByName("root").user == 0);
}

}  // namespace plumbline::account_test
