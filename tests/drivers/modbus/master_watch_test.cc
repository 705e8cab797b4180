#include <catch2/catch.hpp>
#include <mutex>

#include "drivers/modbus/image_handler.h"
#include "drivers/modbus/tcp_server.h"
#include "tests/drivers/modbus/raw_client.h"
#include "tests/drivers/modbus/test_image.h"

namespace plumbline::master_watch_test {

using namespace plumbline::modbus;
using namespace plumbline::modbus;

namespace {

using Bytes = RawClient::Bytes;

Client At(std::uint8_t last, std::uint16_t port) {
  return {ParseIpAddress("192.168.0." + std::to_string(last)).value(), port};
}

/// Complete FC06 frame for one register; the response is the same bytes.
Bytes WriteFrame(std::uint16_t address, std::uint16_t value) {
  return {0,
          1,
          0,
          0,
          0,
          6,
          1,
          6,
          static_cast<std::uint8_t>(address >> 8),
          static_cast<std::uint8_t>(address),
          static_cast<std::uint8_t>(value >> 8),
          static_cast<std::uint8_t>(value)};
}

/// Server with a heartbeat in register 1030 that records the reported masters.
struct Served {
  Latest<RegisterImage> images{2, TestImage()};
  ImageHandler handler{images, Commands(), TestIdentification()};
  std::mutex mutex;
  std::vector<std::string> reports;
  std::unique_ptr<TcpServer> server;

  Served() {
    handler.ReportTwoMasters([this](const Client& writer, const Client& other) {
      const std::lock_guard lock(mutex);
      reports.push_back(TextOf(writer) + " and " + TextOf(other));
    });
    TcpServerOptions options;
    options.port = 0;
    server = TcpServer::Start(options, handler).value();
  }
  static CommandArea Commands() {
    CommandArea commands = TestCommands();
    commands.non_command_registers = {1030, 1030};
    return commands;
  }
  RawClient From(const std::string& address) const { return RawClient(server->port(), address); }
  static void Write(const RawClient& client, std::uint16_t address, std::uint16_t value) {
    const Bytes frame = WriteFrame(address, value);
    REQUIRE(client.Exchange(frame, frame.size()) == frame);
  }
  std::vector<std::string> Reports() {
    const std::lock_guard lock(mutex);
    return reports;
  }
  bool TwoMasters() const { return handler.Commands()->two_masters_until_s > 0; }
};

}  // namespace

TEST_CASE("a master that reconnects, however often, counts as one") {
  MasterWatch watch;
  double now_s = 100;
  for (std::uint16_t port = 50000; port < 50040; ++port) {
    for (int k = 0; k < 3; ++k) CHECK_FALSE(watch.RecordWrite(At(10, port), now_s += 0.1));
  }
}

TEST_CASE(
    "two addresses that write commands within seconds are two masters; long apart they are not") {
  MasterWatch watch;
  CHECK_FALSE(watch.RecordWrite(At(10, 50000), 100));
  CHECK(watch.RecordWrite(At(20, 50000), 101) == At(10, 50000));
  CHECK(watch.RecordWrite(At(10, 50000), 102) == At(20, 50000));
  CHECK_FALSE(watch.RecordWrite(At(10, 50000), 107));
  CHECK_FALSE(watch.RecordWrite(At(20, 50000), 112.1));
}

TEST_CASE("two connections from one address are two masters once both are known to be alive") {
  MasterWatch watch;
  CHECK_FALSE(watch.RecordWrite(At(10, 50000), 100));
  CHECK_FALSE(watch.RecordWrite(At(10, 50001), 101));  // could be a reconnection
  CHECK_FALSE(watch.RecordWrite(At(10, 50001), 102));
  CHECK(watch.RecordWrite(At(10, 50000), 103) == At(10, 50001));
  CHECK(watch.RecordWrite(At(10, 50001), 104) == At(10, 50000));
}

TEST_CASE(
    "the serial line is a client of its own, and more clients than are remembered do no harm") {
  MasterWatch watch;
  CHECK_FALSE(watch.RecordWrite(Client(), 100));
  CHECK(watch.RecordWrite(At(10, 50000), 100.5) == Client());
  for (std::uint8_t k = 1; k < 100; ++k) CHECK(watch.RecordWrite(At(k, 1), 101));
  CHECK(TextOf(Client()) == "the serial line");
  CHECK(TextOf(At(10, 50000)) == "192.168.0.10:50000");
  CHECK(TextOf({ParseIpAddress("fe80::1").value(), 502}) == "[fe80::1]:502");
}

TEST_CASE("TCP server: two addresses that write commands are reported once, with both addresses") {
  Served served;
  const RawClient plc = served.From("127.0.0.1"), panel = served.From("127.0.0.2");
  Served::Write(plc, 1039, 1);
  Served::Write(panel, 1030, 7);  // heartbeat only
  CHECK_FALSE(served.TwoMasters());
  Served::Write(panel, 1001, 7);
  CHECK(served.TwoMasters());
  Served::Write(plc, 1039, 2);
  const auto reports = served.Reports();
  REQUIRE(reports.size() == 1);
  CHECK_THAT(reports[0], Catch::StartsWith("127.0.0.2:") && Catch::Contains(" and 127.0.0.1:"));
  CHECK(served.handler.Commands()->writer.address == ParseIpAddress("127.0.0.1").value());
  CHECK(served.handler.Commands()->writer.port != 0);
}

TEST_CASE(
    "TCP server: a master that reconnects while another client only reads is the only master") {
  Served served;
  const RawClient reader = served.From("127.0.0.3");
  for (std::uint16_t k = 1; k <= 5; ++k) {
    const RawClient plc = served.From("127.0.0.1");
    Served::Write(plc, 1039, k);
    Served::Write(plc, 1030, k);
    const Bytes read = {0, 1, 0, 0, 0, 6, 1, 3, 0, 2, 0, 1};
    CHECK(reader.Exchange(read, 11).size() == 11);
  }
  CHECK_FALSE(served.TwoMasters());
  CHECK(served.Reports().empty());
}

}  // namespace plumbline::master_watch_test
