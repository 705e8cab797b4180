#include "drivers/robot/modbus_robot.h"

#include <modbus/modbus.h>
#include <sys/socket.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <thread>

#include "drivers/robot/registry.h"
#include "tests/drivers/robot/fake_controller.h"
#include "tests/drivers/robot/small_profile.h"
#include "tests/drivers/robot/test_time.h"

namespace plumbline::modbus_robot_test {

using namespace plumbline::robot;

namespace {

using Exchange = FakeController::Exchange;
using Then = FakeController::Then;

RobotConnection ConnectionTo(int port) {
  RobotConnection connection;
  connection.tcp = {"127.0.0.1", port};
  connection.timeout_s = kLinkTimeout_s;
  connection.profile = SmallProfile();
  connection.push = {.enabled = true, .max_step_m = 0.005, .min_period_s = 0.1};
  connection.clock = TestTime;
  return connection;
}

std::unique_ptr<RobotDevice> RobotAt(int port) {
  auto robot = MakeRobot("tcp", ConnectionTo(port));
  REQUIRE(robot.ok());
  return std::move(robot).value();
}

PushPoint PointAt(double x, int slot = 0, int id = 5) {
  PushPoint point;
  point.slot = slot;
  point.id = id;
  point.X_BT.p = Vec3(x, -0.1, 0.2);
  point.valid = true;
  return point;
}

/// A libmodbus server on an ephemeral port, in a thread.
class LibmodbusServer {
 public:
  explicit LibmodbusServer(int port = 0)
      : context_(modbus_new_tcp("127.0.0.1", port)),
        mapping_(modbus_mapping_new(0, 0, 400, 0)),
        listener_(modbus_tcp_listen(context_, 4)) {
    sockaddr_storage address{};
    socklen_t size = sizeof(address);
    getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    std::uint16_t big_endian_port = 0;
    std::memcpy(&big_endian_port, reinterpret_cast<char*>(&address) + 2, 2);
    port_ = (big_endian_port & 0xFF) << 8 | big_endian_port >> 8;
  }
  ~LibmodbusServer() {
    if (thread_.joinable()) {
      shutdown(listener_, SHUT_RDWR);
      shutdown(modbus_get_socket(context_), SHUT_RDWR);
      thread_.join();
    }
    close(listener_);
    modbus_close(context_);
    modbus_mapping_free(mapping_);
    modbus_free(context_);
  }
  void Start() {
    thread_ = std::thread([this] {
      if (modbus_tcp_accept(context_, &listener_) < 0) return;
      std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> query{};
      int length = 0;
      while ((length = modbus_receive(context_, query.data())) >= 0) {
        modbus_reply(context_, query.data(), length, mapping_);
      }
    });
  }
  int port() const { return port_; }
  std::uint16_t& Register(int i) { return mapping_->tab_registers[i]; }  ///< before Start()

 private:
  modbus_t* context_;
  modbus_mapping_t* mapping_;
  int listener_;
  int port_ = 0;
  std::thread thread_;
};

}  // namespace

TEST_CASE("a libmodbus server is read and written") {
  LibmodbusServer server;
  server.Register(0) = 1500;
  server.Register(1) = static_cast<std::uint16_t>(-20);
  server.Start();
  const auto robot = RobotAt(server.port());
  model::RobotState state;
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  REQUIRE(state.q.size() == 2);
  CHECK(state.q[0] == Approx(1.5));
  CHECK(state.q[1] == Approx(-0.02));
  CHECK(state.sequence == 1);
  CHECK(state.timestamp_s == TestTime());
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  CHECK(state.sequence == 2);
  CHECK(robot->Push(std::array{PointAt(0.3)}) == LinkResult::kOk);
}

TEST_CASE("every Modbus table is read with its function code") {
  struct Row {
    RegisterTable table;
    double value;
  };
  const Row rows[] = {{RegisterTable::kCoil, 1},
                      {RegisterTable::kDiscrete, 1},
                      {RegisterTable::kHolding, 258},
                      {RegisterTable::kInput, 258}};
  for (const Row& row : rows) {
    FakeController controller;
    Bytes seen;
    controller.Behave([&seen](Exchange& exchange) {
      seen = exchange.request;
      const bool bits = exchange.request[7] <= 2;
      exchange.answer.assign(exchange.request.begin(), exchange.request.begin() + 4);
      const Bytes rest = bits ? Bytes{0, 4, 1, exchange.request[7], 1, 1}
                              : Bytes{0, 5, 1, exchange.request[7], 2, 1, 2};
      exchange.answer.insert(exchange.answer.end(), rest.begin(), rest.end());
      return Then::kAnswer;
    });
    RobotConnection connection = ConnectionTo(controller.port());
    connection.profile.blocks = {{row.table, 40000, 1}};
    connection.profile.joints = {{ValueAt(40000, RegisterType::kUint16, 1), JointWrap::kNone, {}}};
    connection.profile.joints[0].value.table = row.table;
    auto robot = MakeRobot("tcp", connection);
    REQUIRE(robot.ok());
    model::RobotState state;
    INFO(robot.value()->problem());
    REQUIRE(robot.value()->Read(state) == LinkResult::kOk);
    CHECK(state.q[0] == row.value);
    CHECK(seen[7] == static_cast<std::uint8_t>(row.table));
    CHECK((seen[8] << 8 | seen[9]) == 40000);
  }
}

namespace {

Bytes WithByte(Bytes bytes, std::size_t at, std::uint8_t value) {
  bytes[at] = value;
  return bytes;
}

Then SendHalf(Exchange& exchange) {
  exchange.answer.resize(exchange.answer.size() / 2);
  return Then::kAnswer;
}

Then Reset(Exchange& exchange) {
  const linger now{1, 0};
  setsockopt(exchange.fd, SOL_SOCKET, SO_LINGER, &now, sizeof(now));
  return Then::kClose;
}

Then HalfClose(Exchange& exchange) {
  shutdown(exchange.fd, SHUT_WR);
  return Then::kGoOn;
}

Then Drip(Exchange& exchange) {
  for (const std::uint8_t byte : exchange.answer) {
    if (!FakeController::Send(exchange.fd, {byte})) return Then::kClose;
    std::this_thread::sleep_for(std::chrono::milliseconds(40));
  }
  return Then::kGoOn;
}

Then WrongThenRight(Exchange& exchange) {
  Bytes wrong = exchange.answer;
  wrong[1] = static_cast<std::uint8_t>(wrong[1] + 1);
  wrong[9] = 0x11;
  FakeController::Send(exchange.fd, wrong);
  return Then::kAnswer;
}

Then Replace(Exchange& exchange, std::size_t at, std::uint8_t value) {
  exchange.answer = WithByte(exchange.answer, at, value);
  return Then::kAnswer;
}

Then Exception(Exchange& exchange, std::uint8_t code) {
  exchange.answer.resize(6);
  exchange.answer[5] = 3;
  exchange.answer.insert(exchange.answer.end(), {1, 0x83, code});
  return Then::kAnswer;
}

struct Fault {
  const char* what;
  Then (*behave)(Exchange&);
  LinkResult result;
};

const Fault kFaults[] = {
    {"stalls", [](Exchange&) { return Then::kGoOn; }, LinkResult::kTimeout},
    {"stalls within a frame", SendHalf, LinkResult::kTimeout},
    {"drips a byte every 40 ms", Drip, LinkResult::kTimeout},
    {"resets", Reset, LinkResult::kLost},
    {"closes", [](Exchange&) { return Then::kClose; }, LinkResult::kLost},
    {"half-closes", HalfClose, LinkResult::kLost},
    {"closes within a frame",
     [](Exchange& exchange) {
       SendHalf(exchange);
       FakeController::Send(exchange.fd, exchange.answer);
       return Then::kClose;
     },
     LinkResult::kLost},
    {"wrong transaction id", [](Exchange& e) { return Replace(e, 1, 0xEE); },
     LinkResult::kProtocol},
    {"wrong transaction id, then the right answer", WrongThenRight, LinkResult::kProtocol},
    {"unit id of another robot", [](Exchange& e) { return Replace(e, 6, 2); },
     LinkResult::kProtocol},
    {"protocol id 1", [](Exchange& e) { return Replace(e, 3, 1); }, LinkResult::kProtocol},
    {"header length one too small", [](Exchange& e) { return Replace(e, 5, 10); },
     LinkResult::kProtocol},
    {"header length two too large", [](Exchange& e) { return Replace(e, 5, 13); },
     LinkResult::kProtocol},
    {"other function code", [](Exchange& e) { return Replace(e, 7, 4); }, LinkResult::kProtocol},
    {"fewer registers",
     [](Exchange& exchange) {
       exchange.answer[5] = 5;
       exchange.answer[8] = 2;
       exchange.answer.resize(11);
       return Then::kAnswer;
     },
     LinkResult::kProtocol},
    {"exception 01", [](Exchange& e) { return Exception(e, 1); }, LinkResult::kNoRegisters},
    {"exception 02", [](Exchange& e) { return Exception(e, 2); }, LinkResult::kNoRegisters},
    {"exception 06", [](Exchange& e) { return Exception(e, 6); }, LinkResult::kException},
    {"exception 11", [](Exchange& e) { return Exception(e, 11); }, LinkResult::kNoUnit},
    {"exception 77", [](Exchange& e) { return Exception(e, 77); }, LinkResult::kProtocol},
};

}  // namespace

namespace {

/// Reads until it succeeds; the controller may still be busy with the old connection.
bool ReadAgain(RobotDevice& robot, model::RobotState& state) {
  for (int attempt = 0; attempt < 50; ++attempt) {
    Advance(6);
    if (robot.Read(state) == LinkResult::kOk) return true;
  }
  return false;
}

}  // namespace

TEST_CASE(
    "each misbehaviour of a controller is classified, and reading recovers without a restart") {
  for (const Fault& fault : kFaults) {
    INFO(fault.what);
    FakeController controller;
    controller.Set(0, 100);
    const auto robot = RobotAt(controller.port());
    model::RobotState state;
    REQUIRE(robot->Read(state) == LinkResult::kOk);

    controller.Behave(fault.behave);
    controller.Set(0, 200);
    CHECK(robot->Read(state) == fault.result);
    CHECK_FALSE(robot->problem().empty());
    CHECK(state.q[0] == Approx(0.1));
    CHECK(state.sequence == 1);

    controller.Behave({});
    controller.Set(0, 300);
    if (!IsException(fault.result)) {
      CHECK(robot->Read(state) == LinkResult::kWaiting);
      CHECK_FALSE(robot->problem().empty());
      CHECK(controller.connections() == 1);
    }
    CHECK(ReadAgain(*robot, state));
    CHECK(state.q[0] == Approx(0.3));
    CHECK(state.sequence == 2);
    CHECK((controller.connections() == 1) == IsException(fault.result));
  }
}

TEST_CASE("bytes after a correct response are never taken for the next one") {
  const Bytes extras[] = {
      {0x00},
      {0xDE, 0xAD, 0xBE, 0xEF},
      Bytes(300, 0x00),
      // a complete response of four registers with the next transaction id
      {0x00, 0x03, 0x00, 0x00, 0x00, 0x0B, 0x01, 0x03, 0x08, 1, 1, 1, 1, 1, 1, 1, 1}};
  for (const Bytes& extra : extras) {
    FakeController controller;
    const auto robot = RobotAt(controller.port());
    model::RobotState state;
    REQUIRE(robot->Read(state) == LinkResult::kOk);
    controller.Behave([&extra](Exchange& exchange) {
      FakeController::Send(exchange.fd, exchange.answer);
      FakeController::Send(exchange.fd, extra);
      return Then::kGoOn;
    });
    controller.Set(0, 200);
    REQUIRE(robot->Read(state) == LinkResult::kOk);
    controller.Behave({});
    controller.Set(0, 300);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // let the extra bytes arrive
    const LinkResult result = robot->Read(state);
    INFO(robot->problem());
    CHECK(result != LinkResult::kOk);
    CHECK(state.q[0] == Approx(0.2));
    CHECK(ReadAgain(*robot, state));
    CHECK(state.q[0] == Approx(0.3));
  }
}

TEST_CASE("a late response to an earlier request is never taken for the later one") {
  FakeController controller;
  controller.Set(0, 100);
  const auto robot = RobotAt(controller.port());
  model::RobotState state;
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  Bytes late;
  controller.Behave([&late](Exchange& exchange) {
    if (late.empty()) {
      late = exchange.answer;
      return Then::kGoOn;
    }
    FakeController::Send(exchange.fd, late);  // on the new connection
    return Then::kAnswer;
  });
  CHECK(robot->Read(state) == LinkResult::kTimeout);
  controller.Set(0, 300);
  Advance(0.11);
  CHECK(robot->Read(state) == LinkResult::kProtocol);
  CHECK(state.q[0] == Approx(0.1));
  controller.Behave({});
  CHECK(ReadAgain(*robot, state));
  CHECK(state.q[0] == Approx(0.3));
}

TEST_CASE("garbage of any length never results in a state, a crash or a hang") {
  FakeController controller;
  const auto robot = RobotAt(controller.port());
  model::RobotState state;
  std::uint32_t seed = 12345;
  controller.Behave([&seed](Exchange& exchange) {
    exchange.answer.resize(1 + seed % 300);
    for (std::uint8_t& byte : exchange.answer) {
      seed = seed * 1664525U + 1013904223U;
      byte = static_cast<std::uint8_t>(seed >> 24);
    }
    return Then::kAnswer;
  });
  for (int i = 0; i < 40; ++i) {
    CHECK(robot->Read(state) != LinkResult::kOk);
    Advance(6);
  }
  CHECK(state.sequence == 0);
}

TEST_CASE("the back-off between connection attempts doubles up to 1 s and restarts after success") {
  int port = 0;
  {
    const FakeController gone;
    port = gone.port();
  }
  const auto robot = RobotAt(port);
  model::RobotState state;
  double wait_s = 0.1;
  for (int i = 0; i < 9; ++i) {
    INFO("attempt " << i);
    CHECK(robot->Read(state) == LinkResult::kRefused);
    Advance(0.9 * wait_s);
    CHECK(robot->Read(state) == LinkResult::kWaiting);
    Advance(0.11 * wait_s);
    wait_s = std::min(2 * wait_s, 1.0);
  }
  CHECK(wait_s == 1.0);
  CHECK_THAT(std::string(robot->problem()), Catch::Contains("127.0.0.1:" + std::to_string(port)));
}

TEST_CASE("a controller that reappears is found without a restart") {
  int port = 0;
  std::unique_ptr<RobotDevice> robot;
  model::RobotState state;
  {
    LibmodbusServer first;
    first.Start();
    port = first.port();
    robot = RobotAt(port);
    REQUIRE(robot->Read(state) == LinkResult::kOk);
  }
  CHECK(robot->Read(state) == LinkResult::kLost);
  Advance(0.11);
  CHECK(robot->Read(state) == LinkResult::kRefused);
  LibmodbusServer second(port);
  second.Register(0) = 42;
  second.Start();
  Advance(0.21);
  CHECK(robot->Read(state) == LinkResult::kOk);
  CHECK(state.q[0] == Approx(0.042));
}

TEST_CASE("a controller whose refresh counter is constant gives no fresh readings") {
  FakeController controller;
  RobotConnection connection = ConnectionTo(controller.port());
  connection.profile.sequence = ValueAt(3, RegisterType::kUint16, 1);
  auto robot = MakeRobot("tcp", connection);
  REQUIRE(robot.ok());
  model::RobotState state;
  controller.Set(3, 65535);
  REQUIRE(robot.value()->Read(state) == LinkResult::kOk);
  const double first_s = state.timestamp_s;
  Advance(1);
  REQUIRE(robot.value()->Read(state) == LinkResult::kOk);
  CHECK(state.sequence == 1);
  CHECK(state.timestamp_s == first_s);
  controller.Set(3, 0);
  REQUIRE(robot.value()->Read(state) == LinkResult::kOk);
  CHECK(state.sequence == 2);
  CHECK(state.timestamp_s == TestTime());
}

TEST_CASE("a reading is as old as its first request") {
  FakeController controller;
  RobotConnection connection = ConnectionTo(controller.port());
  connection.profile.blocks.push_back({RegisterTable::kHolding, 10, 4});
  auto robot = MakeRobot("tcp", connection);
  REQUIRE(robot.ok());
  controller.Behave([](Exchange&) {
    Advance(0.2);
    return Then::kAnswer;
  });
  const double before_s = TestTime();
  model::RobotState state;
  REQUIRE(robot.value()->Read(state) == LinkResult::kOk);
  CHECK(TestTime() == Approx(before_s + 0.4));
  CHECK(state.timestamp_s == before_s);
}

namespace {

/// Joints at 0, load and refresh counter at 10: two requests.
RobotConnection SplitConnection(int port) {
  RobotConnection connection = ConnectionTo(port);
  connection.profile.blocks.push_back({RegisterTable::kHolding, 10, 4});
  connection.profile.payload_mass = ValueAt(10, RegisterType::kUint16, 1);
  connection.profile.sequence = ValueAt(11, RegisterType::kUint16, 1);
  return connection;
}

}  // namespace

TEST_CASE("blocks between which the controller refreshed its registers are read again") {
  FakeController controller;
  controller.Set(0, 100);
  controller.Set(10, 20);
  auto robot = MakeRobot("tcp", SplitConnection(controller.port()));
  REQUIRE(robot.ok());
  controller.Behave([&controller](Exchange& exchange) {
    if (exchange.number == 1) {  // between load and joints
      controller.Set(0, 200);
      controller.Set(10, 60);
      controller.Set(11, 1);
    }
    return Then::kAnswer;
  });
  model::RobotState state;
  REQUIRE(robot.value()->Read(state) == LinkResult::kOk);
  CHECK(state.q[0] == Approx(0.2));
  CHECK(state.payload_kg == Approx(60));
  CHECK(controller.requests() == 6);
}

TEST_CASE("a controller that refreshes faster than it is read gives no reading") {
  FakeController controller;
  auto robot = MakeRobot("tcp", SplitConnection(controller.port()));
  REQUIRE(robot.ok());
  controller.Behave([&controller](Exchange& exchange) {
    controller.Set(11, static_cast<std::uint16_t>(exchange.number));
    return Then::kAnswer;
  });
  model::RobotState state;
  CHECK(robot.value()->Read(state) == LinkResult::kTorn);
  CHECK(state.sequence == 0);
  CHECK_THAT(std::string(robot.value()->problem()), Catch::Contains("into one [[read]]"));
  controller.Behave({});
  CHECK(robot.value()->Read(state) == LinkResult::kOk);
}

TEST_CASE("an answer of another unit names both units and the key") {
  FakeController controller;
  const auto robot = RobotAt(controller.port());
  controller.Behave([](Exchange& exchange) { return Replace(exchange, 6, 2); });
  model::RobotState state;
  CHECK(robot->Read(state) == LinkResult::kProtocol);
  CHECK_THAT(std::string(robot->problem()),
             Catch::Contains("unit id 2 instead of 1") && Catch::Contains("robot.unit_id"));
}

TEST_CASE("a pushed point is written to its slot, its sequence last") {
  FakeController controller;
  controller.Set(107, 9);  // left there by an earlier run
  const auto robot = RobotAt(controller.port());
  model::RobotState state;
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  std::vector<int> order;
  controller.OnWrite([&order](int address, auto& /*registers*/) { order.push_back(address); });

  REQUIRE(robot->Push(std::array{PointAt(0.3)}) == LinkResult::kOk);
  CHECK(order == std::vector{107, 100, 101, 102, 103, 104, 105, 106, 107});
  CHECK(controller.Get(100) == 5);
  CHECK(controller.Get(101) == 3000);
  CHECK(controller.Get(102) == static_cast<std::uint16_t>(-1000));
  CHECK(controller.Get(107) == 10);

  order.clear();
  CHECK(robot->Push(std::array{PointAt(0.3)}) == LinkResult::kOk);
  CHECK(order.empty());  // not due yet
  Advance(0.11);
  CHECK(robot->Push(std::array{PointAt(0.3)}) == LinkResult::kOk);
  CHECK(order == std::vector{107});  // only the sequence changes
  CHECK(controller.Get(107) == 11);

  PushPoint invalid = PointAt(0.3);
  invalid.valid = false;
  CHECK(robot->Push(std::array{invalid}) == LinkResult::kOk);
  CHECK(controller.Get(107) == 0);
  Advance(0.11);
  CHECK(robot->Push(std::array{PointAt(0.3)}) == LinkResult::kOk);
  CHECK(controller.Get(107) == 12);
}

TEST_CASE("WithdrawAll() withdraws every slot that may hold a point, and no other") {
  FakeController controller;
  for (const int sequence : {107, 115, 123}) controller.Set(sequence, 9);
  const auto robot = RobotAt(controller.port());
  model::RobotState state;
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  CHECK(robot->WithdrawAll(1) == LinkResult::kOk);
  CHECK(controller.requests() == 1);  // nothing was pushed: no slot is ours

  // Slot 1 is requested but not written yet; it may hold a point of an earlier run.
  REQUIRE(robot->Push(std::array{PointAt(0.3), PointAt(0.4, 1, 6)}) == LinkResult::kOk);
  CHECK(controller.Get(107) == 10);
  SECTION("success") {
    CHECK(robot->WithdrawAll(1) == LinkResult::kOk);
    CHECK(controller.Get(107) == 0);
    CHECK(controller.Get(115) == 0);
    const int requests = controller.requests();
    CHECK(robot->WithdrawAll(1) == LinkResult::kOk);
    CHECK(controller.requests() == requests);
  }
  SECTION("a slot is refused") {
    controller.Behave([](Exchange& exchange) {
      if (exchange.request[9] == 107)
        exchange.answer = {
            exchange.request[0], exchange.request[1], 0, 0, 0, 3, exchange.request[6], 0x86, 4};
      return Then::kAnswer;
    });
    CHECK(robot->WithdrawAll(1) == LinkResult::kException);
    CHECK(controller.Get(115) == 0);
  }
  SECTION("a silent controller costs one timeout") {
    controller.Behave([](Exchange& /*exchange*/) { return Then::kGoOn; });
    const int requests = controller.requests();
    CHECK(robot->WithdrawAll(1) == LinkResult::kTimeout);
    CHECK(controller.requests() == requests + 1);
    CHECK(robot->WithdrawAll(1) == LinkResult::kWaiting);  // does not connect
    CHECK(controller.connections() == 1);
  }
  CHECK(controller.Get(123) == 9);
}

TEST_CASE("a long timeout does not delay the withdrawal") {
  FakeController controller;
  RobotConnection connection = ConnectionTo(controller.port());
  connection.timeout_s = 600;  // longer than the limit of the test
  auto made = MakeRobot("tcp", connection);
  REQUIRE(made.ok());
  RobotDevice& robot = *made.value();
  model::RobotState state;
  REQUIRE(robot.Read(state) == LinkResult::kOk);
  REQUIRE(robot.Push(std::array{PointAt(0.3)}) == LinkResult::kOk);
  controller.Behave([](Exchange& /*exchange*/) { return Then::kGoOn; });
  CHECK(robot.WithdrawAll(0.05) == LinkResult::kTimeout);
}

TEST_CASE("the sequence skips 0 when it wraps") {
  FakeController controller;
  controller.Set(107, 65535);
  const auto robot = RobotAt(controller.port());
  model::RobotState state;
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  REQUIRE(robot->Push(std::array{PointAt(0.3)}) == LinkResult::kOk);
  CHECK(controller.Get(107) == 1);
}

TEST_CASE("registers that read back differently are an error and stay withdrawn") {
  FakeController controller;
  const auto robot = RobotAt(controller.port());
  model::RobotState state;
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  struct Row {
    const char* what;
    int address;
  };
  const Row rows[] = {{"id", 100}, {"x", 101}, {"last angle", 106}};
  for (const Row& row : rows) {
    controller.OnWrite([&row](int address, auto& registers) {
      if (address == row.address) registers[static_cast<std::size_t>(address)] ^= 1;
    });
    INFO(row.what);
    Advance(0.2);
    CHECK(robot->Push(std::array{PointAt(0.3)}) == LinkResult::kPushMismatch);
    CHECK_THAT(std::string(robot->problem()), Catch::Contains("register 100"));
    CHECK(controller.Get(107) == 0);
  }
  controller.OnWrite({});
  Advance(0.2);
  CHECK(robot->Push(std::array{PointAt(0.3)}) == LinkResult::kOk);
  CHECK(controller.Get(107) != 0);
}

TEST_CASE("a point that must not be pushed is refused and only the withdrawal is written") {
  FakeController controller;
  model::RobotState state;
  SECTION("not enabled") {
    RobotConnection connection = ConnectionTo(controller.port());
    connection.push.enabled = false;
    auto robot = MakeRobot("tcp", connection);
    REQUIRE(robot.ok());
    REQUIRE(robot.value()->Read(state) == LinkResult::kOk);
    const int requests = controller.requests();
    CHECK(robot.value()->Push(std::array{PointAt(0.3)}) == LinkResult::kPushRefused);
    CHECK(robot.value()->problem() == "push is not enabled");
    CHECK(controller.requests() == requests);
  }
  SECTION("does not fit the registers") {
    const auto robot = RobotAt(controller.port());
    REQUIRE(robot->Read(state) == LinkResult::kOk);
    CHECK(robot->Push(std::array{PointAt(3.3)}) == LinkResult::kPushRefused);
    CHECK_THAT(std::string(robot->problem()), Catch::Contains("does not fit"));
    CHECK(controller.Get(101) == 0);
    CHECK(controller.Get(107) == 0);
  }
  SECTION("jumps") {
    const auto robot = RobotAt(controller.port());
    REQUIRE(robot->Read(state) == LinkResult::kOk);
    REQUIRE(robot->Push(std::array{PointAt(0.3)}) == LinkResult::kOk);
    Advance(0.2);
    CHECK(robot->Push(std::array{PointAt(0.31)}) == LinkResult::kPushRefused);
    CHECK_THAT(std::string(robot->problem()), Catch::Contains("moved by 10.000 mm"));
    CHECK(controller.Get(101) == 3000);
    CHECK(controller.Get(107) == 0);
    Advance(0.2);
    CHECK(robot->Push(std::array{PointAt(0.31)}) == LinkResult::kOk);
    CHECK(controller.Get(101) == 3100);
    CHECK(controller.Get(107) == 2);
  }
  SECTION("no connection") {
    const auto robot = RobotAt(controller.port());
    CHECK(robot->Push(std::array{PointAt(0.3)}) == LinkResult::kWaiting);
    CHECK(controller.requests() == 0);
  }
}

TEST_CASE("a link that breaks while pushing is reported and reconnected") {
  FakeController controller;
  const auto robot = RobotAt(controller.port());
  model::RobotState state;
  REQUIRE(robot->Read(state) == LinkResult::kOk);
  controller.Behave(
      [](Exchange& exchange) { return exchange.request[7] == 16 ? Then::kClose : Then::kAnswer; });
  CHECK(robot->Push(std::array{PointAt(0.3)}) == LinkResult::kLost);
  CHECK(controller.Get(107) == 0);
  controller.Behave({});
  Advance(0.11);
  CHECK(robot->Read(state) == LinkResult::kOk);
  CHECK(robot->Push(std::array{PointAt(0.3)}) == LinkResult::kOk);
  CHECK(controller.Get(101) == 3000);
}

TEST_CASE("invalid settings are rejected before anything is opened") {
  struct Row {
    const char* what;
    const char* transport;
    void (*spoil)(RobotConnection&);
    const char* message;
  };
  const Row rows[] = {
      {"transport", "udp", [](RobotConnection&) {}, "is not one of tcp, rtu, rtde, replay"},
      {"unit id", "tcp", [](RobotConnection& c) { c.unit_id = 248; }, "unit id 248"},
      {"timeout", "tcp", [](RobotConnection& c) { c.timeout_s = 0; }, "timeout 0 s is outside"},
      {"profile", "tcp", [](RobotConnection& c) { c.profile.joints.clear(); }, "0 joints"},
      {"no push slots", "tcp", [](RobotConnection& c) { c.profile.push.reset(); },
       "has no [push] registers"},
      {"unsound slots", "tcp", [](RobotConnection& c) { c.profile.push->stride = 3; },
       "overlap or exceed"},
      {"baud", "rtu", [](RobotConnection& c) { c.serial.baud = 0; }, "0 baud"},
      {"no rows", "replay", [](RobotConnection&) {}, "no rows"},
  };
  for (const Row& row : rows) {
    RobotConnection connection = ConnectionTo(502);
    row.spoil(connection);
    INFO(row.what);
    const auto robot = MakeRobot(row.transport, connection);
    REQUIRE_FALSE(robot.ok());
    CHECK_THAT(robot.error(), Catch::Contains(row.message));
  }
}

TEST_CASE("a name that cannot be resolved is a lost link, not a fatal error") {
  RobotConnection connection = ConnectionTo(502);
  connection.tcp.host = "no-such-host.invalid";
  auto robot = MakeRobot("tcp", connection);
  REQUIRE(robot.ok());
  model::RobotState state;
  CHECK(robot.value()->Read(state) == LinkResult::kUnknownName);
  CHECK_THAT(std::string(robot.value()->problem()),
             Catch::Contains("no-such-host.invalid:502: the name is not known") &&
                 Catch::Contains("robot.host"));
}

}  // namespace plumbline::modbus_robot_test
