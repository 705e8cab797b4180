// The daemon's configuration as values: what plumbline.toml says, checked, in SI. Most of it is
// what the parts themselves take; their headers document the fields.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/config/camera_config.h"
#include "app/config/loop_config.h"
#include "app/config/mqtt_config.h"
#include "app/config/overlay_config.h"
#include "app/config/page_config.h"
#include "drivers/modbus/rtu_slave.h"
#include "drivers/modbus/tcp_server.h"
#include "drivers/plc/register_map.h"
#include "drivers/robot/registry.h"
#include "firmware-like/machine.h"

namespace plumbline {

/// Where the service keeps its state.
inline constexpr const char* kUsualStateDirectory = "/var/lib/plumbline";

struct RobotLinkConfig {
  std::string transport = "tcp";  ///< one of RobotTransports()
  RobotConnection connection;     ///< its replay's rows are still in replay_file
  std::string replay_file;        ///< a measured.csv whose joints are played
};

struct PlcConfig {
  modbus::TcpServerOptions tcp;                ///< changed by a restart only
  std::optional<modbus::RtuSlaveOptions> rtu;  ///< likewise
  PlcConvention convention;
};

struct DaemonConfig {
  std::string file;  ///< where it was read from
  std::string cell_file;
  MachineConfig machine;  ///< its cell with the base and tip of its last session, where it has any
  RobotLinkConfig robot;
  PlcConfig plc;
  LoopConfig loop;
  VisionConfig vision;             ///< changed by a restart only
  OverlayConfig overlay;           ///< of plumbline-view; the daemon only checks it
  PageConfig page;                 ///< likewise
  std::optional<MqttConfig> mqtt;  ///< of plumbline-fleet; likewise
  /// Corrected points written into the controller's registers, in the order of the profile's
  /// slots; whether at all, and how fast, is robot.connection.push.
  std::vector<int> push_ids;
  double cycle_period_s = 0.01;
  std::string state_directory = kUsualStateDirectory;  ///< changed by a restart only
};

}  // namespace plumbline
