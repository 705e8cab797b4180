#include "drivers/modbus/rtu_slave.h"

#include <fcntl.h>
#include <modbus/modbus.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/drivers/modbus/rtu_frame.h"
#include "tests/drivers/modbus/test_image.h"

namespace plumbline::rtu_slave_test {

using namespace plumbline::modbus;

namespace {

/// Pseudo-terminal: one end as a descriptor, the other as a device.
class Line {
 public:
  Line() : fd_(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    REQUIRE(::grantpt(fd_) == 0);
    REQUIRE(::unlockpt(fd_) == 0);
    device_ = ::ptsname(fd_);
    keep_open_ = ::open(device_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
    termios raw{};
    ::tcgetattr(keep_open_, &raw);
    ::cfmakeraw(&raw);
    ::tcsetattr(keep_open_, TCSANOW, &raw);
  }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;
  ~Line() {
    ::close(keep_open_);
    ::close(fd_);
  }

  int fd() const { return fd_; }
  const std::string& device() const { return device_; }

  void Send(const Bytes& bytes) const {
    REQUIRE(::write(fd_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()));
  }
  /// Up to `size` bytes; fewer if nothing arrives for `patience_ms`.
  Bytes Receive(std::size_t size, int patience_ms) const {
    Bytes bytes;
    while (bytes.size() < size) {
      pollfd wait{.fd = fd_, .events = POLLIN, .revents = 0};
      std::array<std::uint8_t, 300> piece;
      if (::poll(&wait, 1, patience_ms) <= 0) break;
      const ssize_t got = ::read(fd_, piece.data(), std::min(piece.size(), size - bytes.size()));
      if (got <= 0) break;
      bytes.insert(bytes.end(), piece.begin(), piece.begin() + got);
    }
    return bytes;
  }

 private:
  int fd_, keep_open_ = -1;
  std::string device_;
};

/// Connects two lines, like a cable.
class Cable {
 public:
  Cable(const Line& a, const Line& b) : thread_([&a, &b, this] { Run(a.fd(), b.fd()); }) {}
  Cable(const Cable&) = delete;
  Cable& operator=(const Cable&) = delete;
  ~Cable() {
    stop_ = true;
    thread_.join();
  }

 private:
  void Run(int a, int b) const {
    while (!stop_) {
      pollfd fds[] = {{.fd = a, .events = POLLIN, .revents = 0},
                      {.fd = b, .events = POLLIN, .revents = 0}};
      if (::poll(fds, 2, 20) <= 0) continue;
      if ((fds[0].revents & POLLIN) != 0) Copy(a, b);
      if ((fds[1].revents & POLLIN) != 0) Copy(b, a);
    }
  }
  static void Copy(int from, int to) {
    std::array<std::uint8_t, 300> bytes;
    const ssize_t size = ::read(from, bytes.data(), bytes.size());
    if (size > 0 && ::write(to, bytes.data(), static_cast<std::size_t>(size)) != size) ::abort();
  }

  std::atomic<bool> stop_{false};
  std::thread thread_;
};

std::unique_ptr<RtuSlave> StartSlave(const RtuSlaveOptions& options, RequestHandler& handler) {
  auto slave = RtuSlave::Start(options, handler);
  if (!slave) FAIL(slave.error());
  return std::move(slave).value();
}

void WaitForOpenings(const RtuSlave& slave, std::uint64_t count) {
  while (slave.counters().openings < count) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

const Bytes kRead = {3, 0, 2, 0, 1};
const Bytes kReadReply = {3, 2, 0, 2};
constexpr int kQuiet_ms = 100;  // wait before a slave counts as silent

}  // namespace

TEST_CASE("RTU slave: libmodbus as master", "[modbus][rtu]") {
  TestDevice device;
  const Line slave_line, master_line;
  const Cable cable(slave_line, master_line);
  const auto slave = StartSlave({.device = slave_line.device(), .unit_id = 5}, device.handler);
  WaitForOpenings(*slave, 1);
  modbus_t* master = modbus_new_rtu(master_line.device().c_str(), 19200, 'E', 8, 1);
  REQUIRE(master != nullptr);
  modbus_set_slave(master, 5);
  modbus_set_response_timeout(master, 5, 0);
  REQUIRE(modbus_connect(master) == 0);
  std::uint16_t words[125];
  REQUIRE(modbus_read_registers(master, 100, 125, words) == 125);
  CHECK(words[124] == 224);
  CHECK(modbus_write_register(master, 1000, 77) == 1);
  const std::uint16_t values[] = {8, 9};
  CHECK(modbus_write_registers(master, 1001, 2, values) == 2);
  REQUIRE(modbus_write_and_read_registers(master, 1003, 2, values, 1000, 3, words) == 3);
  CHECK(words[0] == 77);
  CHECK(modbus_mask_write_register(master, 1000, 0, 1) == 1);
  std::uint8_t bits[8];
  CHECK(modbus_read_bits(master, 0, 8, bits) == 8);
  CHECK(modbus_write_bit(master, 20, 1) == 1);
  CHECK(modbus_read_registers(master, 50, 1, words) == -1);
  CHECK(errno == EMBXILADD);
  modbus_close(master);
  modbus_free(master);
  CHECK(device.handler.Commands()->registers.values[4] == 9);
}

TEST_CASE("RTU slave: requests that are answered on a shared line", "[modbus][rtu]") {
  Bytes broken = Rtu(5, kRead);
  broken.back() ^= 1;
  struct Case {
    const char* what;
    Bytes line, answer;
  };
  const Case cases[] = {
      {"own request", Rtu(5, kRead), Rtu(5, kReadReply)},
      {"unknown function", Rtu(5, {0x55, 1, 2}), Rtu(5, {0xD5, 1})},
      {"wrong length", Rtu(5, {3, 0, 2, 0, 1, 0}), Rtu(5, {0x83, 3})},
      {"identification", Rtu(5, {43, 14, 4, 2}),
       Rtu(5, {43, 14, 4, 0x82, 0, 0, 1, 2, 3, '1', '.', '0'})},
      {"another's request", Rtu(9, kRead), {}},
      {"another's reply that carries a request", Rtu(9, Bytes{3, 8} + Rtu(5, kRead)), {}},
      {"another's exchange, then ours", Rtu(9, kRead) + Rtu(9, kReadReply) + Rtu(5, kRead),
       Rtu(5, kReadReply)},
      {"the master has gone on", Rtu(5, kRead) + Rtu(9, kRead), {}},
      {"request sent twice, answered once", Rtu(5, kRead) + Rtu(5, kRead), Rtu(5, kReadReply)},
      {"broadcast read", Rtu(0, kRead), {}},
      {"wrong check sum", broken, {}},
      {"noise", {1, 2, 3, 4, 5, 6, 7}, {}},
  };
  TestDevice device;
  const Line line;
  const auto slave = StartSlave({.device = line.device(), .unit_id = 5}, device.handler);
  WaitForOpenings(*slave, 1);
  for (const Case& c : cases) {
    INFO(c.what);
    line.Send(c.line);
    CHECK(line.Receive(c.answer.size() + 1, kQuiet_ms) == c.answer);
  }
  line.Send(Rtu(5, kRead));
  CHECK(line.Receive(7, 5000) == Rtu(5, kReadReply));
}

TEST_CASE("RTU slave: a broadcast is executed and not answered", "[modbus][rtu]") {
  TestDevice device;
  const Line line;
  const auto slave = StartSlave({.device = line.device(), .unit_id = 5}, device.handler);
  WaitForOpenings(*slave, 1);
  line.Send(Rtu(0, {6, 0x03, 0xE8, 0x12, 0x34}));
  CHECK(line.Receive(1, kQuiet_ms).empty());
  CHECK(device.handler.Commands()->registers.values[0] == 0x1234);
  CHECK(slave->counters().broadcasts == 1);
}

TEST_CASE("RTU slave: a frame in two pieces, as USB adapters deliver it", "[modbus][rtu]") {
  TestDevice device;
  const Line line;
  const auto slave =
      StartSlave({.device = line.device(), .unit_id = 5, .frame_timeout_s = 5}, device.handler);
  WaitForOpenings(*slave, 1);
  const Bytes frame = Rtu(5, kRead);
  line.Send({frame.begin(), frame.begin() + 3});
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  line.Send({frame.begin() + 3, frame.end()});
  CHECK(line.Receive(7, 5000) == Rtu(5, kReadReply));
  CHECK(slave->counters().discarded == 0);
}

TEST_CASE("RTU slave: a device is missing, lost and restored", "[modbus][rtu]") {
  TestDevice device;
  const auto folder =
      std::filesystem::temp_directory_path() / ("plumbline-rtu-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const auto link = folder / "tty";
  std::atomic<int> lost{0}, restored{0};
  {
    const auto slave = StartSlave(
        {.device = link,
         .unit_id = 5,
         .on_change = [&](const std::string& because) { ++(because.empty() ? restored : lost); }},
        device.handler);
    for (std::uint64_t round = 1; round <= 3; ++round) {
      while (lost < static_cast<int>(round)) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      const Line line;
      std::filesystem::remove(link);
      std::filesystem::create_symlink(line.device(), link);
      WaitForOpenings(*slave, round);
      line.Send(Rtu(5, kRead));
      CHECK(line.Receive(7, 5000) == Rtu(5, kReadReply));
    }
  }
  std::filesystem::remove_all(folder);
  CHECK(restored == 3);
  CHECK(lost <= 4);  // reported once per loss, not at every attempt
}

TEST_CASE("RTU slave: each invalid setting has its message", "[modbus][rtu]") {
  TestDevice device;
  struct Case {
    RtuSlaveOptions options;
    const char* message;
  };
  const Case cases[] = {
      {{.device = "/dev/null", .baud = 12345}, "baud 12345 is not one of"},
      {{.device = "/dev/null", .parity = 'X'}, "parity \"X\" is not one of"},
      {{.device = "/dev/null", .stop_bits = 3}, "stop bits 3 is not"},
      {{.device = "/dev/null", .unit_id = 0}, "unit id 0 is outside 1..247"},
      {{.device = "/dev/null", .unit_id = 248}, "unit id 248 is outside 1..247"},
  };
  for (const Case& c : cases) {
    const auto slave = RtuSlave::Start(c.options, device.handler);
    REQUIRE_FALSE(slave.ok());
    CHECK_THAT(slave.error(), Catch::Contains(c.message));
  }
}

}  // namespace plumbline::rtu_slave_test
