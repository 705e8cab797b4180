#include "app/doctor/account.h"

#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <fstream>

#include "tests/app/temporary_folder.h"

using namespace plumbline;
using test::TemporaryFolder;

namespace {

constexpr uid_t kSomeone = 54321;
constexpr gid_t kTheirGroup = 54322;
const Account kService{"service", kSomeone, {kTheirGroup}};

}  // namespace

TEST_CASE("rights are those of owner, group or others, of the file and of every folder above") {
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/device";
  std::ofstream(file) << "x";
  chmod(folder.path().c_str(), 0755);
  chmod(file.c_str(), 0664);
  CHECK(WhyNoAccess(kService, file, false).empty());
  CHECK_THAT(WhyNoAccess(kService, file, true),
             Catch::EndsWith("664) may not be read and written by service"));
  chmod(file.c_str(), 0640);
  CHECK_THAT(WhyNoAccess(kService, file, false),
             Catch::EndsWith("640) may not be read by service"));
  if (geteuid() == 0) {  // only root may give a file away
    REQUIRE(chown(file.c_str(), 0, kTheirGroup) == 0);
    CHECK(WhyNoAccess(kService, file, false).empty());
    REQUIRE(chown(file.c_str(), kSomeone, 0) == 0);
    CHECK(WhyNoAccess(kService, file, true).empty());
  }
  chmod(file.c_str(), 0666);
  chmod(folder.path().c_str(), 0700);
  CHECK_THAT(WhyNoAccess(kService, file, false), Catch::EndsWith("700) does not let service in"));
  CHECK(WhyNoAccess({"root", 0, {}}, file, true).empty());
  CHECK_THAT(WhyNoAccess(kService, "/nonexistent/device", false),
             Catch::EndsWith("/nonexistent: No such file or directory"));
}

TEST_CASE("a user that is not there is oneself") {
  CHECK(AccountOf("no-such-user-here").user == geteuid());
  CHECK(AccountOf("root").user == 0);
}
