// Daemon configuration: the checked content of plumbline.toml and the files it refers to, in SI.
//
// Most members are option structs of other modules, whose headers document the fields.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/base/config/camera_config.h"
#include "app/base/config/monitoring_config.h"
#include "app/base/config/mqtt_config.h"
#include "app/base/config/page_config.h"
#include "drivers/gauge/gauge.h"
#include "drivers/modbus/rtu_slave.h"
#include "drivers/modbus/tcp_server.h"
#include "drivers/motion/motion_settings.h"
#include "drivers/plc/register_map.h"
#include "drivers/robot/registry.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/lens.h"
#include "firmware-like/machine.h"
#include "firmware-like/status/camera_status.h"

namespace plumbline::config {

// Configuration of a [[gauge]]: a dial gauge whose button makes a probe.

struct GaugeConfig {
  std::string artefact;  ///< name of the [[artefact]] of kind "gauge"
  gauge::GaugeOptions connection;
  std::optional<double> sigma_m;  ///< standard deviation of a reading; if nullopt, the cell's

  bool operator==(const GaugeConfig&) const = default;
};

// Display configuration of plumbline-view, [overlay] of plumbline.toml.

class NamedFiles;
class TomlTable;
struct VisionConfig;

struct OverlayConfig {
  enum class Display { kNone, kKms, kFramebuffer };
  /// Where the unloaded tool is drawn, relative to the deflected one.
  enum class Nominal { kHidden, kBehind, kBeside };

  Display display = Display::kNone;
  std::string device;                        ///< device of the display; empty: the first one
  std::optional<status::CameraName> camera;  ///< the camera shown; all if nullopt
  std::optional<image::ImageSize> size;      ///< if nullopt, the display's, else 1280 x 720
  std::string objects_file;                  ///< object table; empty: only the tool's axis is drawn
  bool background = true;                    ///< draw the camera image behind the objects
  double exaggeration = 1;                   ///< factor by which the deflection is drawn larger
  Nominal nominal = Nominal::kHidden;
  bool stress = false;            ///< colour bending objects by stress
  double stress_full_Pa = 250e6;  ///< upper end of the colour scale
  double grid_m = 0;              ///< distance of the lines of the ground grid; 0: no grid
  double grid_z_m = 0;            ///< height of the grid in the measurement frame
  double near_m = 0;              ///< default distance for pairs of the object table
};

/// @param vision  defines the camera names that are allowed
OverlayConfig OverlayFromToml(const TomlTable& table, const NamedFiles& files,
                              const VisionConfig& vision);

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
  motion_link::MotionSettings motion;
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
