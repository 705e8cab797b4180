#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <mutex>
#include <thread>

#include "drivers/robot/registry.h"
#include "tests/drivers/robot/fake_controller.h"
#include "tests/drivers/robot/small_profile.h"
#include "tests/drivers/robot/test_time.h"

namespace plumbline::rtu_robot_test {

using namespace plumbline::robot;

namespace {

/// CRC-16/MODBUS, low byte first [Modbus over serial line, 6.2.2].
Bytes WithCrc(Bytes frame) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : frame) {
    crc ^= byte;
    for (int i = 0; i < 8; ++i) crc = (crc & 1) != 0 ? crc >> 1 ^ 0xA001 : crc >> 1;
  }
  frame.push_back(static_cast<std::uint8_t>(crc & 0xFF));
  frame.push_back(static_cast<std::uint8_t>(crc >> 8));
  return frame;
}

/// Fake controller at the other end of a pseudo-terminal. It answers FC03: register 0 is
/// `word`, the others are 0; `spoil` may modify the frame, or empty it for silence.
class SerialController {
 public:
  explicit SerialController(const std::string& path) {
    master_ = posix_openpt(O_RDWR | O_NOCTTY);
    grantpt(master_);
    unlockpt(master_);
    char name[128];
    ptsname_r(master_, name, sizeof(name));
    slave_ = open(name, O_RDWR | O_NOCTTY);  // so that closing the client causes no hang-up
    termios raw{};
    tcgetattr(slave_, &raw);
    cfmakeraw(&raw);
    tcsetattr(slave_, TCSANOW, &raw);
    std::filesystem::remove(path);
    std::filesystem::create_symlink(name, path);
    thread_ = std::thread([this] { Run(); });
  }
  ~SerialController() {
    stop_ = true;
    thread_.join();
    close(slave_);
    close(master_);
  }
  SerialController(const SerialController&) = delete;
  SerialController& operator=(const SerialController&) = delete;

  void Spoil(std::function<void(Bytes&)> spoil) {
    const std::lock_guard lock(mutex_);
    spoil_ = std::move(spoil);
  }
  std::atomic<int> word{0};

 private:
  void Run() {
    Bytes request;
    while (!stop_) {
      pollfd waiting{master_, POLLIN, 0};
      if (poll(&waiting, 1, 5) <= 0) continue;
      std::array<std::uint8_t, 64> buffer{};
      const auto count = read(master_, buffer.data(), buffer.size());
      if (count <= 0) continue;
      request.insert(request.end(), buffer.begin(), buffer.begin() + count);
      if (request.size() < 8) continue;
      const int value = word;
      Bytes answer(3 + 2U * request[5], 0);
      answer[0] = request[0];
      answer[1] = 3;
      answer[2] = static_cast<std::uint8_t>(2 * request[5]);
      answer[3] = static_cast<std::uint8_t>(value >> 8);
      answer[4] = static_cast<std::uint8_t>(value & 0xFF);
      answer = WithCrc(answer);
      request.clear();
      {
        const std::lock_guard lock(mutex_);
        if (spoil_) spoil_(answer);
      }
      if (!answer.empty() && write(master_, answer.data(), answer.size()) < 0) return;
    }
  }

  int master_ = -1;
  int slave_ = -1;
  std::atomic<bool> stop_{false};
  std::mutex mutex_;
  std::function<void(Bytes&)> spoil_;
  std::thread thread_;
};

struct Folder {
  Folder() {
    std::string pattern = std::filesystem::temp_directory_path() / "plumbline-rtu-XXXXXX";
    if (mkdtemp(pattern.data()) != nullptr) path = pattern;
  }
  ~Folder() { std::filesystem::remove_all(path); }
  std::string path;
};

std::unique_ptr<RobotDevice> RobotOn(const std::string& device) {
  RobotConnection connection;
  connection.serial = {device, 115200, 'E', 1};
  connection.unit_id = 17;
  connection.timeout_s = kLinkTimeout_s;
  connection.profile = SmallProfile();
  connection.clock = TestTime;
  auto robot = MakeRobot("rtu", connection);
  REQUIRE(robot.ok());
  return std::move(robot).value();
}

/// On a busy machine the fake controller may answer after the timeout.
LinkResult ReadAtLast(RobotDevice& robot, model::RobotState& state) {
  LinkResult result = robot.Read(state);
  for (int tries = 0; result != LinkResult::kOk && tries < 20; ++tries) {
    SleepSeconds(0.1);
    Advance(1);
    result = robot.Read(state);
  }
  return result;
}

}  // namespace

TEST_CASE("a controller on a serial line is read, and each line fault is survived") {
  struct Row {
    const char* what;
    std::function<void(Bytes&)> spoil;
    LinkResult result;
  };
  const Row rows[] = {
      {"silence", [](Bytes& answer) { answer.clear(); }, LinkResult::kTimeout},
      {"half a frame", [](Bytes& answer) { answer.resize(5); }, LinkResult::kTimeout},
      {"wrong checksum", [](Bytes& answer) { answer.back() ^= 1; }, LinkResult::kProtocol},
      {"another slave's answer",
       [](Bytes& answer) {
         answer.resize(answer.size() - 2);
         answer[0] = 18;
         answer = WithCrc(answer);
       },
       LinkResult::kProtocol},
      {"exception 02",
       [](Bytes& answer) {
         answer = WithCrc({17, 0x83, 2});
       },
       LinkResult::kNoRegisters},
  };
  const Folder folder;
  for (const Row& row : rows) {
    INFO(row.what);
    SerialController controller(folder.path + "/tty");
    const auto robot = RobotOn(folder.path + "/tty");
    controller.word = 100;
    model::RobotState state;
    REQUIRE(ReadAtLast(*robot, state) == LinkResult::kOk);
    CHECK(state.q[0] == Approx(0.1));
    controller.Spoil(row.spoil);
    CHECK(robot->Read(state) == row.result);
    controller.Spoil({});
    controller.word = 300;
    Advance(0.11);
    CHECK(robot->Read(state) == LinkResult::kOk);
    CHECK(state.q[0] == Approx(0.3));
  }
}

TEST_CASE(
    "a reading on a line with a second copy of an answer is refused, and the next one is good") {
  const Folder folder;
  SerialController controller(folder.path + "/tty");
  const auto robot = RobotOn(folder.path + "/tty");
  model::RobotState state;
  controller.word = 100;
  REQUIRE(ReadAtLast(*robot, state) == LinkResult::kOk);
  controller.word = 200;
  controller.Spoil([](Bytes& answer) {
    const Bytes twice = answer;
    answer.insert(answer.end(), twice.begin(), twice.end());
  });
  CHECK(robot->Read(state) == LinkResult::kProtocol);
  CHECK(state.q[0] == Approx(0.1));
  controller.Spoil({});
  controller.word = 300;
  CHECK(ReadAtLast(*robot, state) == LinkResult::kOk);
  CHECK(state.q[0] == Approx(0.3));
}

TEST_CASE("short disturbances between two frames are ignored") {
  const Folder folder;
  SerialController controller(folder.path + "/tty");
  const auto robot = RobotOn(folder.path + "/tty");
  model::RobotState state;
  REQUIRE(ReadAtLast(*robot, state) == LinkResult::kOk);
  controller.Spoil([](Bytes& answer) { answer.push_back(0); });
  controller.word = 300;
  CHECK(ReadAtLast(*robot, state) == LinkResult::kOk);
  CHECK(state.q[0] == Approx(0.3));
}

TEST_CASE("a late response on a line is not taken for a later one, and reading recovers") {
  const Folder folder;
  SerialController controller(folder.path + "/tty");
  const auto robot = RobotOn(folder.path + "/tty");
  model::RobotState state;
  controller.word = 100;
  REQUIRE(ReadAtLast(*robot, state) == LinkResult::kOk);
  Bytes late;
  controller.Spoil([&late](Bytes& answer) {
    // The block's answer is withheld, and sent before the answer to the next request.
    if (late.empty() && answer.size() == 13) {
      late = std::exchange(answer, {});
    } else if (!late.empty()) {
      answer.insert(answer.begin(), late.begin(), late.end());
      late = {0};
    }
  });
  CHECK(robot->Read(state) == LinkResult::kTimeout);
  controller.word = 300;
  for (int i = 0; i < 20 && state.q[0] != Approx(0.3); ++i) {
    Advance(2);
    robot->Read(state);
    controller.Spoil({});
    CHECK((state.q[0] == Approx(0.1) || state.q[0] == Approx(0.3)));
  }
  CHECK(state.q[0] == Approx(0.3));
}

TEST_CASE("an unplugged line is retried with increasing waits, and found again") {
  const Folder folder;
  const std::string device = folder.path + "/tty";
  const auto robot = RobotOn(device);
  model::RobotState state;
  {
    SerialController controller(device);
    REQUIRE(ReadAtLast(*robot, state) == LinkResult::kOk);
  }
  CHECK(robot->Read(state) == LinkResult::kLost);
  int attempts = 0;
  for (int i = 0; i < 100; ++i) {
    Advance(0.01);
    if (robot->Read(state) != LinkResult::kWaiting) ++attempts;
  }
  CHECK(attempts <= 4);
  CHECK(attempts >= 2);
  SerialController plugged_in_again(device);
  plugged_in_again.word = 7;
  Advance(5);
  CHECK(ReadAtLast(*robot, state) == LinkResult::kOk);
  CHECK(state.q[0] == Approx(0.007));
}

}  // namespace plumbline::rtu_robot_test
