// Link faults have the documented effect on values and connections.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/virtual_cell/running_cell.h"

namespace virtual_cell::faults_test {
namespace {

/// A raw socket to the cell, to observe what libmodbus hides.
class RawClient {
 public:
  explicit RawClient(const std::string& where) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port =
        htons(static_cast<std::uint16_t>(std::stoi(where.substr(where.find(':') + 1))));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
    const timeval patience{5, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }
  ~RawClient() { ::close(socket_); }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  void Ask(std::uint8_t transaction) {
    const std::array<std::uint8_t, 12> request = {0, transaction, 0, 0, 0, 6, 1, 3, 1, 2, 0, 1};
    REQUIRE(::send(socket_, request.data(), request.size(), MSG_NOSIGNAL) == 12);
  }
  /// Bytes received, 0 at the end of the stream, -1 on an error (errno) or after five seconds.
  ssize_t Receive() { return ::recv(socket_, answer_.data(), answer_.size(), 0); }
  bool Silent() {
    return ::recv(socket_, answer_.data(), 1, MSG_PEEK | MSG_DONTWAIT) < 0 && errno == EAGAIN;
  }
  int transaction() const { return answer_[1]; }
  int function() const { return answer_[7]; }

 private:
  int socket_;
  std::array<std::uint8_t, 260> answer_ = {};
};

TEST_CASE("faults that corrupt values") {
  RunningCell cell({.profile = Profile::kGeneric, .idle = true});
  RegisterClient robot("robot", cell.robot(), 1, 5);
  const double x = static_cast<double>(robot.Read(16, 2).Float(0));
  SECTION("nan") {
    REQUIRE(cell.Tell("fault nan on") == "ok");
    CHECK(Eventually([&] { return std::isnan(robot.Read(0, 2).Float(0)); }));
    CHECK(std::isnan(robot.Read(16, 2).Float(0)));
    REQUIRE(cell.Tell("fault nan off") == "ok");
    CHECK(Eventually([&] { return std::isfinite(robot.Read(0, 2).Float(0)); }));
  }
  SECTION("jump") {
    REQUIRE(cell.Tell("fault jump on") == "ok");
    CHECK(Eventually(
        [&] { return std::abs(static_cast<double>(robot.Read(16, 2).Float(0)) - x - 10) < 1e-3; }));
  }
  SECTION("a joint outside its limits") {
    REQUIRE(cell.Tell("fault joint 2 7.5") == "ok");
    CHECK(Eventually([&] { return robot.Read(2, 2).Float(0) == 7.5F; }));
    REQUIRE(cell.Tell("fault joint off") == "ok");
    CHECK(Eventually([&] { return robot.Read(2, 2).Float(0) < 0; }));
  }
}

TEST_CASE("NaN in the UR profile is reported as the invalid integer") {
  RunningCell cell({.idle = true});
  RegisterClient robot("robot", cell.robot(), 1, 5);
  REQUIRE(cell.Tell("fault nan on") == "ok");
  CHECK(Eventually([&] { return robot.Read(150, 2).Long(0) == 0x80000000U; }));
  CHECK(robot.Read(400, 1).Word(0) == 0x8000);
}

TEST_CASE("a stalled controller answers nothing, then everything") {
  RunningCell cell({.idle = true});
  RawClient client(cell.robot());
  client.Ask(1);
  REQUIRE(client.Receive() == 11);
  REQUIRE(cell.Tell("fault stall 0.3") == "ok");
  client.Ask(2);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  CHECK(client.Silent());
  CHECK(client.Receive() == 11);
  CHECK(client.transaction() == 2);
}

TEST_CASE("a delayed answer arrives after the next request was sent") {
  RunningCell cell({.idle = true});
  RawClient client(cell.robot());
  REQUIRE(cell.Tell("fault delay 0.2") == "ok");
  client.Ask(1);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  CHECK(client.Silent());
  client.Ask(2);
  CHECK(client.Receive() > 0);
  CHECK(client.transaction() == 1);
}

TEST_CASE("a reset ends the connection with an error; a new connection is accepted") {
  RunningCell cell({.idle = true});
  RawClient client(cell.robot());
  client.Ask(1);
  REQUIRE(client.Receive() == 11);
  REQUIRE(cell.Tell("fault reset") == "ok");
  CHECK(client.Receive() == -1);
  CHECK(errno == ECONNRESET);
  RawClient again(cell.robot());
  again.Ask(2);
  CHECK(again.Receive() == 11);
}

TEST_CASE("a half-closed connection takes requests and never answers") {
  RunningCell cell({.idle = true});
  RawClient client(cell.robot());
  client.Ask(1);
  REQUIRE(client.Receive() == 11);
  REQUIRE(cell.Tell("fault half-close") == "ok");
  CHECK(client.Receive() == 0);
  client.Ask(2);
  CHECK(client.Receive() == 0);
}

TEST_CASE("busy exceptions instead of values") {
  RunningCell cell({.idle = true});
  RawClient client(cell.robot());
  REQUIRE(cell.Tell("fault exception on") == "ok");
  client.Ask(1);
  CHECK(client.Receive() == 9);
  CHECK(client.function() == 0x83);
  REQUIRE(cell.Tell("fault exception off") == "ok");
  client.Ask(2);
  CHECK(client.Receive() == 11);
}

TEST_CASE("the console rejects invalid lines with the reason") {
  RunningCell cell({.idle = true});
  for (const char* line : {"fault", "fault nan", "fault stall soon", "fault joint 2", "move 1 2",
                           "payload", "payload -3", "jump", ""}) {
    CAPTURE(line);
    CHECK_THAT(cell.Tell(line), Catch::StartsWith("error: "));
  }
  CHECK(cell.Tell("move 9000 0 0 0 0 0") == "error: unreachable");
  CHECK(cell.Tell("joints 0 0 0 0 0 0") == "error: outside limits");
  CHECK(cell.Tell("payload 42") == "ok");
  RegisterClient robot("robot", cell.robot(), 1, 5);
  CHECK(Eventually([&] { return robot.Read(140, 1).Word(0) == 4200; }));
  CHECK(cell.Tell("temperature 31") == "ok");
  CHECK(Eventually([&] { return robot.Read(769, 1).Word(0) == 31; }));
}

}  // namespace
}  // namespace virtual_cell::faults_test
