// Daemon configuration: the checked content of plumbline.toml and the files it refers to, in SI.
//
// Most members are option structs of other modules, whose headers document the fields.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/base/config/camera_config.h"
#include "app/base/config/gauge_config.h"
#include "app/base/config/monitoring_config.h"
#include "app/base/config/mqtt_config.h"
#include "app/base/config/overlay_config.h"
#include "app/base/config/page_config.h"
#include "drivers/modbus/rtu_slave.h"
#include "drivers/modbus/tcp_server.h"
#include "drivers/plc/register_map.h"
#include "drivers/robot/registry.h"
#include "firmware-like/machine.h"

namespace plumbline::config {

/// Default state directory, that of the service.
inline constexpr const char* kDefaultStateDirectory = "/var/lib/plumbline";

struct RobotLinkConfig {
  std::string transport = "tcp";  ///< of drivers/robot/registry.h
  robot::RobotConnection
      connection;           ///< for "replay", without the rows of replay_file, which are read later
  std::string replay_file;  ///< a measured.csv whose joints are played back
};

struct PlcConfig {
  modbus::TcpServerOptions tcp;                ///< a change takes effect at the next start
  std::optional<modbus::RtuSlaveOptions> rtu;  ///< a change takes effect at the next start
  plc::PlcConvention convention;
};

struct DaemonConfig {
  std::string file;  ///< path of plumbline.toml
  std::string cell_file;
  MachineConfig machine;  ///< the cell has the base and tip of its last session, if it has sessions
  RobotLinkConfig robot;
  PlcConfig plc;
  std::vector<GaugeConfig> gauges;
  MonitoringConfig monitoring;
  VisionConfig vision;             ///< a change takes effect at the next start
  OverlayConfig overlay;           ///< used by plumbline-view; the daemon uses the object table
  PageConfig page;                 ///< used by plumbline-view; the daemon only checks it
  std::optional<MqttConfig> mqtt;  ///< used by plumbline-fleet; the daemon only checks it
  /// Ids of the points written into the controller's registers, in the order of the profile's
  /// slots. robot.connection.push enables the writing and limits its rate.
  std::vector<int> push_ids;
  double cycle_period_s = 0.01;
  std::string state_directory =
      kDefaultStateDirectory;  ///< a change takes effect at the next start
};

}  // namespace plumbline::config
