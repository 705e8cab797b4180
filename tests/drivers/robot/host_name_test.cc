#include "drivers/robot/host_name.h"

#include <catch2/catch.hpp>

namespace plumbline::host_name_test {

using plumbline::robot::IsAddress;
using plumbline::robot::ResolveFailure;

TEST_CASE("a numeric address is distinguished from a host name") {
  for (const char* address : {"192.168.1.10", "127.0.0.1", "::1", "fe80::1"}) {
    INFO(address);
    CHECK(IsAddress(address));
  }
  for (const char* name : {"robot", "localhost", "robot.cell-3.plant", "192.168.1.300", ""}) {
    INFO(name);
    CHECK_FALSE(IsAddress(name));
  }
  CHECK(ResolveFailure("127.0.0.1") == nullptr);
}

}  // namespace plumbline::host_name_test
