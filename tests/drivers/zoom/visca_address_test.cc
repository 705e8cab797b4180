#include "drivers/zoom/visca_address.h"

#include <catch2/catch.hpp>

namespace plumbline::visca_address_test {

using namespace plumbline::visca;

TEST_CASE("paths and addresses, with the port of their transport unless given") {
  struct Case {
    const char *device, *transport, *text;
  };
  const Case cases[] = {
      {"/dev/serial/by-id/x", "", "/dev/serial/by-id/x"},
      {"./line", "serial", "./line"},
      {"192.168.1.9", "", "udp://192.168.1.9:52381"},
      {"192.168.1.9", "udp", "udp://192.168.1.9:52381"},
      {"192.168.1.9", "tcp", "tcp://192.168.1.9:5678"},
      {"tcp://192.168.1.9", "", "tcp://192.168.1.9:5678"},
      {"tcp://192.168.1.9:1259", "tcp", "tcp://192.168.1.9:1259"},
      {"udp://camera.local:1", "", "udp://camera.local:1"},
      {"zoom-camera:65535", "", "udp://zoom-camera:65535"},
      {"[fe80::1%eth0]", "", "udp://[fe80::1%eth0]:52381"},
      {"[fd00::9]:99", "tcp", "tcp://[fd00::9]:99"},
      {"fd00::9", "", "udp://[fd00::9]:52381"},
  };
  for (const Case& c : cases) {
    CAPTURE(c.device, c.transport);
    const auto address = AddressFrom(c.device, c.transport);
    REQUIRE(address);
    CHECK(address->Text() == c.text);
  }
}

TEST_CASE("what is neither, or contradicts the transport, is named") {
  struct Case {
    const char *device, *transport, *fault;
  };
  const Case cases[] = {
      {"/dev/ttyUSB0", "tcp", "is a serial line"},
      {"192.168.1.9", "serial", "is a network address"},
      {"tcp://192.168.1.9", "udp", "contradicts transport"},
      {"udp://192.168.1.9", "tcp", "contradicts transport"},
      {"192.168.1.9", "http", "needs transport"},
      {"http://192.168.1.9", "", "scheme"},
      {"ttyUSB0", "", "/dev/tty"},
      {"192.168.1.300", "", "four numbers"},
      {"tcp://192.168.1.256:99", "", "four numbers"},
      {"192.168.1", "", "four numbers"},
      {"192.168..1", "", "four numbers"},
      {"192.168.1.9.7", "", "four numbers"},
      {"192.168.1.", "", "four numbers"},
      {"0000192.168.1.9", "", "four numbers"},
      {"3232235785", "", "four numbers"},
      {"192.168.1.9:0", "", "port outside"},
      {"192.168.1.9:65536", "", "port outside"},
      {"192.168.1.9:", "", "port outside"},
      {"192.168.1.9:80x", "", "port outside"},
      {"[fe80::1", "", "neither"},
      {"[fe80::1]80", "", "neither"},
      {"[]", "", "neither"},
      {"my camera", "", "neither"},
      {"", "", "neither"},
      {"tcp://", "", "neither"},
  };
  for (const Case& c : cases) {
    CAPTURE(c.device, c.transport);
    const auto address = AddressFrom(c.device, c.transport);
    REQUIRE_FALSE(address);
    CHECK_THAT(address.error(), Catch::Contains(c.fault));
  }
}

}  // namespace plumbline::visca_address_test
