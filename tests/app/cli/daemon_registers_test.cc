// Registers read from a server in this process.
#include "app/cli/daemon_registers.h"

#include <catch2/catch.hpp>
#include <memory>

#include "drivers/modbus/image_handler.h"
#include "drivers/modbus/tcp_server.h"
#include "drivers/plc/codec.h"

namespace plumbline::daemon_registers_test {

using namespace plumbline::cli;

namespace {

/// A Modbus server with a fixed register image, all of it readable.
class Served {
 public:
  explicit Served(std::vector<std::uint16_t> registers)
      : images_(2, ImageOf(std::move(registers))), handler_(images_, {}, {}) {
    modbus::TcpServerOptions options;
    options.port = 0;
    auto started = modbus::TcpServer::Start(options, handler_);
    if (!started) FAIL(started.error());
    server_ = std::move(started).value();
  }
  int port() const { return server_->port(); }

 private:
  static modbus::RegisterImage ImageOf(std::vector<std::uint16_t> registers) {
    modbus::RegisterImage image;
    image.readable =
        std::make_shared<modbus::AddressRanges>(std::vector<modbus::AddressRanges::Range>{
            {0, static_cast<std::uint16_t>(registers.size() - 1)}});
    image.registers = std::move(registers);
    return image;
  }

  Latest<modbus::RegisterImage> images_;
  modbus::ImageHandler handler_;
  std::unique_ptr<modbus::TcpServer> server_;
};

std::vector<std::uint16_t> TwoPoints(plc::PlcConvention convention) {
  Snapshot snapshot;
  snapshot.reading.q = model::JointVector::LinSpaced(6, -1, 1.5);
  snapshot.status = status::kReady;
  snapshot.points.resize(2);
  plc::PlcEnvironment environment;
  environment.uptime_s = 12;
  plc::PlcEncoder encoder(convention, {7, 9});
  return encoder.Encode(snapshot, environment);
}

}  // namespace

TEST_CASE("the registers of a daemon are read in either word order") {
  for (const bool little : {false, true}) {
    CAPTURE(little);
    plc::PlcConvention convention;
    convention.little_word_first = little;
    const Served served(TwoPoints(convention));
    const auto daemon = DaemonRegisters::Read("127.0.0.1", served.port());
    INFO((daemon ? "" : daemon.error()));
    REQUIRE(daemon);
    CHECK(daemon->points() == 2);
    CHECK(daemon->Value("uptime") == 12);
    CHECK(daemon->Status(status::kReady));
    CHECK_FALSE(daemon->Status(status::kError));
    CHECK(daemon->has_postures());
    CHECK(daemon->Value("point_id", 0) == 7);
    CHECK(daemon->Value("point_id", 1) == 9);
  }
}

TEST_CASE("a daemon without posture blocks is read, too") {
  std::vector<std::uint16_t> registers = TwoPoints({});
  registers.resize(plc::registers::kPoints + 2 * plc::registers::kPointSize);
  const Served served(std::move(registers));
  const auto daemon = DaemonRegisters::Read("127.0.0.1", served.port());
  REQUIRE(daemon);
  CHECK(daemon->points() == 2);
  CHECK_FALSE(daemon->has_postures());
}

TEST_CASE("each reason why the registers cannot be read has a remedy") {
  const Served other(std::vector<std::uint16_t>(100, 0));
  const std::string place = "127.0.0.1:" + std::to_string(other.port());
  CHECK(DaemonRegisters::Read("127.0.0.1", other.port()).error() ==
        place +
            ": another server is listening there: its Modbus registers are not plumblined's; set "
            "--host and --port to the daemon's plc.listen and plc.port");
  CHECK_THAT(DaemonRegisters::Read("127.0.0.1", 1).error(),
             Catch::StartsWith("127.0.0.1:1: Connection refused; check that plumblined is running "
                               "and that host and port match plc.listen and plc.port"));
  CHECK_THAT(DaemonRegisters::Read("no-such-host.invalid", 1502).error(),
             Catch::StartsWith("no-such-host.invalid:1502: unknown host name (") &&
                 Catch::EndsWith("; check --host"));
}

}  // namespace plumbline::daemon_registers_test
