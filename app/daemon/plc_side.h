// How the PLC reaches the daemon: Modbus TCP, and a serial line where one is configured.
#pragma once

#include <memory>

#include "app/config/daemon_config.h"
#include "app/daemon/lifeline.h"
#include "app/service/service_manager.h"
#include "drivers/modbus/image_handler.h"

namespace plumbline {

/// Opened at the start, changed by a restart only. Tells transitions to the log.
class PlcSide {
 public:
  PlcSide() = default;  ///< serves nothing

  /// @param manager  may hold the listening socket, and clients' connections of a daemon before
  /// @return         or why it cannot be served, with a remedy
  static Result<std::unique_ptr<PlcSide>> Open(const PlcConfig& config, ServiceManager& manager,
                                               modbus::ImageHandler& handler);

  /// Has the service manager keep the connections of clients that have asked something, so that a
  /// restart does not cut them. Now and then, from one thread.
  void KeepConnections(const ServiceManager& manager);

  const modbus::TcpServer& server() const { return *server_; }
  void AddTo(Lifeline& lifeline) const;

 private:
  std::unique_ptr<modbus::TcpServer> server_;
  std::unique_ptr<modbus::RtuSlave> slave_;
};

/// What clients may ask of the device itself.
modbus::DeviceIdentification Identification();

/// Whether what was opened differs: it takes a restart.
bool PlcSideDiffers(const PlcConfig& a, const PlcConfig& b);

}  // namespace plumbline
