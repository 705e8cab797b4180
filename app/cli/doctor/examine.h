// All checks of an installation, in the order in which problems should be fixed.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "app/base/config/daemon_config.h"
#include "drivers/camera/v4l2_device.h"

namespace plumbline::cli {

// User account of the service, whose file permissions are checked instead of the caller's.

struct Account {
  std::string name;
  uid_t user = 0;
  std::vector<gid_t> groups;
};

/// The account of that name; if there is none, that of the calling user.
Account AccountByName(const std::string& name);

/// The reason why `account` may not read (and write) `path`, from the modes of the file and its
/// parent directories; empty if it may. Ignores access control lists and security modules.
std::string AccessProblem(const Account& account, const std::string& path, bool write);

// Result of one check of the installation: health, finding and remedy.

enum class Health {
  kGood,
  kNotChecked,  ///< not configured, or not observable from here
  kWarning,     ///< works, but not for long or not as well as it could
  kFault,       ///< does not work
};

inline const char* HealthText(Health health) {
  return health == Health::kGood         ? "good"
         : health == Health::kNotChecked ? "-"
         : health == Health::kWarning    ? "warning"
                                         : "FAULT";
}

struct CheckResult {
  Health health = Health::kGood;
  std::string subject;  ///< "state directory"
  std::string finding;  ///< "/var/lib/plumbline, 12.3 GiB free"
  std::string remedy;   ///< what to do; empty if nothing
};

using CheckResults = std::vector<CheckResult>;

// Checks of the cell: daemon, robot, PLC access, camera, zoom sensor, gauges, display and MQTT
// broker.

/// State and alarms of the running daemon, which owns robot and camera. Only if no daemon runs, the
/// robot itself is read, and the readings judged as the daemon does (robot_reading.h): many
/// controllers accept one connection, and a serial line one master.
/// @param runs  set to whether a daemon runs
CheckResults CheckDaemon(const config::DaemonConfig& config, bool& runs);
/// Who may send commands to the Modbus server: anyone, if plc.allow is empty.
CheckResult CheckPlcAccess(const modbus::TcpServerOptions& plc);
/// Whether the camera is connected, uniquely identified and accessible.
CheckResult CheckCamera(const config::CameraConfig& camera, const Account& account,
                        const camera::DeviceTree& tree = {});
/// Whether the sensor's device is accessible. Not checked for a HID sensor, which only its own
/// driver finds. A camera in the network is asked only if no daemon runs, because a second client
/// resets the sequence of its commands.
CheckResult CheckZoomSensor(const config::ZoomConfig& zoom, const Account& account,
                            bool daemon_runs = false);
/// Whether the gauge's serial line is accessible, or its HID device can be opened.
CheckResult CheckGauge(const config::GaugeConfig& gauge, const Account& account);
/// Whether the MQTT broker accepts a connection and the files configured for it are readable.
CheckResult CheckBroker(const config::MqttConfig& mqtt, const Account& account);
CheckResult CheckDisplay(const config::OverlayConfig& overlay, const Account& account);

// Checks of the computer: clock, state directory, system journal, programs.

/// Whether the clock is synchronised and was ever set.
CheckResult CheckClock();
/// Whether the state directory exists, is writable for `account` and has free space.
CheckResult CheckStateDirectory(const std::string& directory, const Account& account);
/// Whether every row of the measurement journal is as it was written; nothing if there is none.
CheckResults CheckJournal(const std::string& state_directory);
/// Whether the systemd journal is persistent.
CheckResult CheckSystemJournal(const std::string& persistent = "/var/log/journal");
/// Whether the programs needed at run time are installed: plumbline-mesh, gnuplot.
/// @param program_directory  directory of Plumbline's own programs
CheckResults CheckPrograms(const config::DaemonConfig& config,
                           const std::string& program_directory);

/// @param user  account of the service, whose permissions are checked; the calling user's if there
///              is no account of that name
CheckResults Examine(const std::string& config_file, const std::string& user);

}  // namespace plumbline::cli
