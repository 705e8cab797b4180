// What hangs on the computer: the daemon, its robot, camera, zoom sensor, display, and the plant's
// broker.
#pragma once

#include "app/config/daemon_config.h"
#include "app/doctor/account.h"
#include "app/doctor/check_up.h"
#include "drivers/camera/v4l2_device.h"

namespace plumbline {

/// Asks the running daemon, which holds robot and camera; where none runs, the robot itself, with
/// one reading.
CheckUp LookAtDaemon(const DaemonConfig& config);
/// Who may give commands to the PLC's side: whoever reaches the port, where plc.allow names nobody.
CheckedThing LookAtAccess(const modbus::TcpServerOptions& plc);
/// Whether the camera is plugged in, the only one of that name, and may be used.
CheckedThing LookAtCamera(const CameraConfig& camera, const Account& account,
                          const DeviceTree& tree = {});
/// Rights of the sensor's device; a sensor that is a HID is found by its own driver only.
CheckedThing LookAtZoom(const ZoomConfig& zoom, const Account& account);
/// Whether the plant's broker lets this computer in, and the files named for it may be read.
CheckedThing LookAtBroker(const MqttConfig& mqtt, const Account& account);
CheckedThing LookAtDisplay(const OverlayConfig& overlay, const Account& account);

}  // namespace plumbline
