#include "app/base/config/daemon_config_checks.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/base/config/limits.h"
#include "drivers/robot/codec.h"
#include "firmware-like/loads/numbered_load.h"
#include "firmware-like/motion_offset/motion_correction.h"

namespace plumbline::config {
namespace {

/// Adds a fault if the cell has several tools or payload items, and the controller does not report
/// which of them is in use.
void RequireNumbers(const model::CellModel& cell, const robot::RobotSignals& signals,
                    const TomlTable& root) {
  const auto robot = root.Table("robot");
  if (!robot) return;
  const bool rtde = signals.key != "profile";
  if (cell.tools() > 1 && !signals.tool_number) {
    robot->AddFault(
        signals.key,
        fmt::format("reads no tool number, but the cell declares {} [[tool]]; {}, or "
                    "leave one tool in the cell",
                    cell.tools(), rtde ? "set rtde_tool_register" : "add [tool_number] to it"));
  }
  if (!cell.payload_items.empty() && !signals.payload_item) {
    robot->AddFault(signals.key,
                    fmt::format("reads no payload item, but the cell declares {} "
                                "[[payload.item]]; {}, or remove the items from the cell",
                                cell.payload_items.size(),
                                rtde ? "set rtde_item_register" : "add [payload_item] to it"));
  }
}

/// Adds a fault for each payload by tool number whose tool the cell does not declare.
void CheckPayloadTable(const model::CellModel& cell, const PayloadPolicy& policy,
                       const TomlTable& root) {
  const auto payload = root.Table("payload");
  if (!payload || policy.source != PayloadPolicy::Source::kTable || !cell.tool.number) return;
  const std::vector<TomlTable> tools = payload->Tables("tool");
  for (std::size_t k = 0; k < std::min(tools.size(), policy.table.size()); ++k) {
    const int number = policy.table[k].number;
    if (number < 0 || loads::ToolIndexOf(cell, number)) continue;
    tools[k].AddFault("number",
                      fmt::format("{} is not the number of a [[tool]] of the cell: no point is "
                                  "corrected with it; declare that tool, or remove this entry",
                                  number));
  }
}

/// Checks that the robot link provides everything that the configuration needs from it.
void CheckAgainstSignals(const TomlTable& root, const DaemonConfig& config, bool cell_known) {
  using Source = PayloadPolicy::Source;
  const robot::RobotProfile& profile = config.robot.connection.profile;
  const robot::RobotSignals signals =
      robot::SignalsOf(config.robot.transport, config.robot.connection);
  const int cell_joints = config.machine.cell.robot.size();
  const bool push_enabled = config.robot.connection.push.enabled;
  const auto robot = root.Table("robot");
  const auto payload = root.Table("payload");
  const auto push = root.Table("push");
  if (cell_known && robot && signals.joints != cell_joints) {
    robot->AddFault(signals.key,
                    fmt::format("has {} joints; the cell has {}", signals.joints, cell_joints));
  }
  if (config.robot.transport == "replay") {
    if (push_enabled && push)
      push->AddFault("enabled", "is not possible with transport \"replay\"");
    return;
  }
  if (robot && config.robot.transport == "rtu") {
    if (const auto fault = robot::SerialFault(profile, push_enabled))
      robot->AddFault("profile", *fault);
  }
  if (config.machine.payload.source == Source::kRobot && !signals.payload_mass) {
    const std::string what =
        fmt::format("{} reads no payload mass; use \"table\" or \"fixed\"", signals.source);
    if (payload) payload->AddFault("source", "cannot be used: " + what);
    if (!payload) root.AddWarning("payload", "missing, and " + what);
  }
  if (config.machine.payload.source == Source::kTable && !signals.tool_number && payload) {
    payload->AddFault(
        "source", fmt::format("requires a tool number, which {} does not read", signals.source));
  }
  RequireNumbers(config.machine.cell, signals, root);
  CheckPayloadTable(config.machine.cell, config.machine.payload, root);
  if (!push || !push_enabled) return;
  if (signals.push_slots == 0) {
    push->AddFault("enabled", config.robot.transport == "rtde"
                                  ? "requires free registers from rtde_first_int and "
                                    "rtde_first_double to 47"
                                  : fmt::format("requires a [push] table in {}", signals.source));
  } else if (static_cast<int>(config.push_ids.size()) > signals.push_slots) {
    push->AddFault("point_ids", fmt::format("has {} ids; {} has {} slots", config.push_ids.size(),
                                            signals.source, signals.push_slots));
  }
}

/// PLC server and page cannot share a port.
void CheckPorts(const TomlTable& root, const DaemonConfig& config) {
  const auto page = root.Table("page");
  if (!page) return;
  const std::string &plc = config.plc.tcp.address, &own = config.page.listen;
  if (config.page.port.value_or(0) == 0 || *config.page.port != config.plc.tcp.port) return;
  if (plc != own && !IsWildcardAddress(plc) && !IsWildcardAddress(own)) return;
  page->AddFault("port",
                 fmt::format("is the same as [plc] port, and the addresses {} and {} overlap; give "
                             "the page another port",
                             plc, own));
}

/// A gauge whose readings cannot be recorded, or whose line belongs to another device.
void CheckGauges(const TomlTable& root, const DaemonConfig& config) {
  if (config.gauges.empty()) return;
  if (!config.monitoring.enabled) {
    root.AddWarning("gauge",
                    "readings of gauges are not recorded: set enabled = true in [monitoring]");
  }
  for (const GaugeConfig& gauge : config.gauges) {
    if (gauge.connection.kind != gauge::GaugeKind::kSerial) continue;
    const std::string& device = gauge.connection.device;
    const bool of_robot =
        config.robot.transport == "rtu" && device == config.robot.connection.serial.device;
    const bool of_plc = config.plc.rtu && device == config.plc.rtu->device;
    if (of_robot || of_plc) {
      root.AddFault("gauge", fmt::format("uses {}, which is the line of {}", device,
                                         of_robot ? "[robot]" : "[plc.rtu]"));
    }
  }
}

/// Robot data must not become stale between two cycles, nor long after the robot has moved on.
void CheckStaleAfter(const TomlTable& root, const DaemonConfig& config) {
  constexpr double kOldData_s = 1;
  const double stale_after_s = config.machine.plausibility.stale_after_s;
  const auto robot = root.Table("robot");
  if (!robot) return;
  if (stale_after_s > kOldData_s) {
    robot->AddWarning(
        "stale_after_ms",
        fmt::format("keeps points valid that are corrected for where the robot was up "
                    "to {:g} s ago; use at most 1000, and a faster link if that is "
                    "too short",
                    stale_after_s));
  }
  if (stale_after_s >= config.cycle_period_s) return;
  robot->AddFault("stale_after_ms",
                  fmt::format("is less than the cycle time of {:g} ms: robot data would always be "
                              "stale",
                              config.cycle_period_s / kSecondPerMs));
}

/// The motion link does not use reports that are too old.
void CheckMotionCycle(const TomlTable& root, const DaemonConfig& config) {
  const auto cycle = root.Table("cycle");
  if (!cycle || !config.motion.enabled) return;
  if (config.cycle_period_s <= motion_offset::kLongestCycle_s) return;
  cycle->AddFault("period_ms", fmt::format("must be at most {:g} with [motion]: it would correct "
                                           "on old readings, or not at all",
                                           motion_offset::kLongestCycle_s / kSecondPerMs));
}

}  // namespace

void CheckAcrossTables(const TomlTable& root, const DaemonConfig& config, bool cell_known) {
  CheckGauges(root, config);
  CheckPorts(root, config);
  CheckMotionCycle(root, config);
  CheckStaleAfter(root, config);
  const bool known =
      config.robot.transport == "rtde" || !config.robot.connection.profile.joints.empty();
  if (known) CheckAgainstSignals(root, config, cell_known);
}

}  // namespace plumbline::config
