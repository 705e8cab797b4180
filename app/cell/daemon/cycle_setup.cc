#include "app/cell/daemon/cycle_setup.h"

#include <fmt/format.h>

#include <atomic>

#include "app/base/log/log.h"
#include "app/cell/model_store/usable_model.h"

namespace plumbline::cell {
namespace {

/// Enough for the branches of an ordinary cell.
constexpr double kBranchesTimeout_s = 0.3;

/// Adds the motion link, if it is configured; the running one if its settings have not changed.
/// @return  why it cannot be used
Result<void> AddMotion(const config::DaemonConfig& config, const CycleParts* in_use,
                       CycleParts& parts) {
  static std::atomic<std::uint64_t> generations{0};
  if (!config.motion.enabled) return {};
  if (in_use != nullptr && in_use->motion && in_use->motion->settings() == config.motion) {
    parts.motion = in_use->motion;
  } else {
    auto made = motion_link::MotionLink::Create(config.motion);
    if (!made) return made.failure();
    parts.motion = std::move(made).value();
  }
  parts.motion_model = std::make_shared<const motion_offset::MotionModel>(
      motion_offset::MotionModel{++generations, {config.machine.cell, config.machine.limits}});
  return {};
}

}  // namespace

std::unique_ptr<CycleParts> PartsFrom(const ConfigInForce& in_force, const CycleParts* in_use) {
  const config::DaemonConfig& config = in_force.config;
  if (const auto why_not = ModelUnusableReason(config.machine.cell)) {
    log::Log({log::Event::kFileFault, fmt::format("{}: {}; fix or remove that effect in this file",
                                                  config.cell_file, *why_not)});
    return nullptr;
  }
  const auto refuse = [](const std::string& why) {
    log::Log({log::Event::kRobotSetupFailed, fmt::format("robot: {}", why)});
    return nullptr;
  };
  Result<RobotSetup> robot = RobotSetupFrom(config);
  if (!robot) return refuse(robot.error());
  std::shared_ptr<robot::RobotLink> link;
  if (in_use != nullptr && in_use->robot == *robot) {
    link = in_use->link;
  } else {
    Result<std::unique_ptr<robot::RobotDevice>> device =
        robot::MakeRobot(robot->transport, robot->connection);
    if (!device) return refuse(device.error());
    link = std::make_shared<robot::RobotLink>(std::move(device).value());
  }
  auto parts = std::make_unique<CycleParts>(config, std::move(link), in_force.models.applied);
  parts->robot = std::move(robot).value();
  if (const Result<void> added = AddMotion(config, in_use, *parts); !added) {
    log::Log({log::Event::kRobotSetupFailed, fmt::format("motion: {}", added.error())});
    return nullptr;
  }
  parts->model_superseded = !in_force.set_aside.empty();
  return parts;
}

void AwaitBranches(CycleParts& parts) {
  const double until_s = MonotonicSeconds() + kBranchesTimeout_s;
  while (!parts.branches.finished() && MonotonicSeconds() < until_s) SleepSeconds(0.002);
  parts.branches.DeliverTo(parts.machine, parts.machine.config().points.size());
}

modbus::RegisterImage FirstImage(CycleParts& parts, std::uint16_t boot_count) {
  MachineInput nothing;
  nothing.background_warnings = parts.model_superseded ? warning::kModelSetAside : std::uint16_t{0};
  modbus::RegisterImage image;
  image.readable = parts.readable;
  image.registers = parts.encoder.Encode(parts.machine.Cycle(nothing),
                                         EnvironmentAtStart(boot_count, parts.period_s));
  image.bits.resize(plc::registers::kBits);
  return image;
}

}  // namespace plumbline::cell
