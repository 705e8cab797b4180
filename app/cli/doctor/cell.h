// Checks of the cell: daemon, robot, PLC access, camera, zoom sensor, gauges, display and MQTT
// broker.
#pragma once

#include "app/base/config/daemon_config.h"
#include "app/cli/doctor/account.h"
#include "app/cli/doctor/check_result.h"
#include "drivers/camera/v4l2_device.h"

namespace plumbline::cli {

/// State and alarms of the running daemon, which owns robot and camera. If no daemon runs, reads
/// the robot once.
CheckResults CheckDaemon(const config::DaemonConfig& config);
/// Who may send commands to the Modbus server: anyone, if plc.allow is empty.
CheckResult CheckPlcAccess(const modbus::TcpServerOptions& plc);
/// Whether the camera is connected, uniquely identified and accessible.
CheckResult CheckCamera(const config::CameraConfig& camera, const Account& account,
                        const camera::DeviceTree& tree = {});
/// Whether the sensor's device is accessible. Not checked for a HID sensor, which only its own
/// driver finds.
CheckResult CheckZoomSensor(const config::ZoomConfig& zoom, const Account& account);
/// Whether the gauge's serial line is accessible, or its HID device can be opened.
CheckResult CheckGauge(const config::GaugeConfig& gauge, const Account& account);
/// Whether the MQTT broker accepts a connection and the files configured for it are readable.
CheckResult CheckBroker(const config::MqttConfig& mqtt, const Account& account);
CheckResult CheckDisplay(const config::OverlayConfig& overlay, const Account& account);

}  // namespace plumbline::cli
