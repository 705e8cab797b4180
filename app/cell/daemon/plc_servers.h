// The daemon's Modbus servers for the PLC: TCP, and a serial line if one is configured.
#pragma once

#include <memory>

#include "app/base/config/daemon_config.h"
#include "app/base/service/service_manager.h"
#include "app/cell/daemon/thread_watchdog.h"
#include "drivers/modbus/image_handler.h"

namespace plumbline::cell {

/// Opened at the start; changes need a restart. Logs transitions.
class PlcServers {
 public:
  PlcServers() = default;  ///< serves nothing

  /// @param manager  may hold the listening socket, and client connections of the previous daemon
  /// @return         why the PLC cannot be served, with a remedy
  static Result<std::unique_ptr<PlcServers>> Open(const config::PlcConfig& config,
                                                  service::ServiceManager& manager,
                                                  modbus::ImageHandler& handler);

  /// Deposits client connections with the service manager, so that a restart does not break them;
  /// only connections on which a request has arrived. To be called regularly, from one thread.
  void DepositConnections(const service::ServiceManager& manager);

  const modbus::TcpServer& server() const { return *server_; }
  void AddTo(ThreadWatchdog& watchdog) const;

 private:
  std::unique_ptr<modbus::TcpServer> server_;
  std::unique_ptr<modbus::RtuSlave> slave_;
};

/// Modbus device identification that clients can read.
modbus::DeviceIdentification Identification();

/// Whether any setting differs whose change needs a restart.
bool PlcServersDiffer(const config::PlcConfig& a, const config::PlcConfig& b);

}  // namespace plumbline::cell
