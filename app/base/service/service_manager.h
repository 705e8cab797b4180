// Client of the service manager (systemd): notification, watchdog, socket activation, descriptor
// store.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/os/descriptor.h"

namespace plumbline::service {

/// Without a service manager every call has no effect.
class ServiceManager {
 public:
  /// Reads NOTIFY_SOCKET, WATCHDOG_USEC, LISTEN_FDS and LISTEN_FDNAMES from the environment and
  /// removes the last three, so that child processes do not inherit them. Call it before any thread
  /// is started.
  ServiceManager();

  bool available() const { return available_; }
  /// Interval at which to call NotifyWatchdog() [s]; nullopt if there is no watchdog.
  std::optional<double> watchdog_period_s() const { return feed_period_s_; }
  void NotifyWatchdog() const;
  /// Triggers the watchdog, so that the service is killed and restarted at once instead of after
  /// the watchdog period. Has no effect without a watchdog.
  void RequestRestart() const;

  /// Reports that start-up is complete; `status` is one line for `systemctl status`.
  void Ready(const std::string& status) const;
  void Status(const std::string& status) const;
  void Reloading() const;
  void Stopping() const;

  /// Takes an inherited socket of this name; an empty descriptor if there is none left. A listening
  /// socket outlives the daemon: clients that connect during a restart wait instead of being
  /// refused.
  os::Descriptor TakeSocket(const std::string& name);
  /// Takes all inherited sockets of this name that are left.
  std::vector<os::Descriptor> TakeSockets(const std::string& name);

  /// Stores descriptors under this name in the service manager's descriptor store and closes them
  /// here. The next process of the service takes them with TakeSockets(), however this one ended.
  /// The service manager discards a stored connection by itself once that connection has been shut
  /// down [sd_pid_notify_with_fds(3), FDSTORE=1].
  void StoreDescriptors(const std::string& name, std::vector<os::Descriptor> descriptors) const;

 private:
  bool available_ = false;
  std::optional<double> feed_period_s_;
  struct Inherited {
    std::string name;
    os::Descriptor descriptor;
  };
  std::vector<Inherited> inherited_;
};

}  // namespace plumbline::service
