#include "app/daemon/cyclic_loop.h"

#include <catch2/catch.hpp>
#include <chrono>

#include "tests/firmware-like/test_cell.h"

using namespace plumbline;

namespace {

/// A controller that never answers, and takes its time over it.
class SilentRobot : public RobotDevice {
 public:
  LinkResult Read(RobotState&) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    return LinkResult::kTimeout;
  }
  LinkResult Push(std::span<const PushPoint>) override { return LinkResult::kOk; }
  LinkResult WithdrawAll(double) override { return LinkResult::kOk; }
  std::string_view problem() const override { return "silent"; }
};

std::unique_ptr<CycleParts> PartsWith(int points) {
  DaemonConfig config;
  config.machine.cell = test::HeavyArm();
  config.cycle_period_s = 0.1;
  for (int id = 1; id <= points; ++id) config.machine.points.emplace_back().id = id;
  return std::make_unique<CycleParts>(config, std::make_unique<SilentRobot>(), 1);
}

}  // namespace

TEST_CASE("after a replacement the newest snapshot is one of the new configuration") {
  auto parts = PartsWith(1);
  modbus::RegisterImage first_image;
  first_image.readable = parts->readable;
  Latest<modbus::RegisterImage> images(1, first_image);
  modbus::ImageHandler handler(images, EmptyCommandArea(), {});
  LoopLink link;
  CyclicLoop loop(std::move(parts), handler, images, link, 1, nullptr);
  loop.Start();
  for (const int points : {2, 3, 1}) {
    loop.Replace(PartsWith(points));
    CHECK(loop.ReadSnapshot()->points.size() == static_cast<std::size_t>(points));
  }
}
