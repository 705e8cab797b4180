// The service manager that started the daemon, where there is one: systemd.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/os/descriptor.h"

namespace plumbline {

/// Every call does nothing where no service manager listens.
class ServiceManager {
 public:
  /// Reads the environment: WATCHDOG_USEC, LISTEN_FDS and LISTEN_FDNAMES, which children do not
  /// inherit from then on, and NOTIFY_SOCKET. Before any thread is started.
  ServiceManager();

  /// Whether there is one.
  bool listens() const { return listens_; }
  /// How often Feed() is wanted [s]; nothing: nobody waits for it.
  std::optional<double> feed_period_s() const { return feed_period_s_; }
  void Feed() const;
  /// A thread stands still: the daemon is to be killed and started anew now, not when nobody has
  /// fed for the whole period. Nothing where no period was asked for.
  void AskForRestart() const;

  /// Serves from now on; `status` is one line for `systemctl status`.
  void Ready(const std::string& status) const;
  void Status(const std::string& status) const;
  void Reloading() const;
  void Stopping() const;

  /// The listening socket that the service manager holds under this name, once, or none. It
  /// outlives the daemon: clients that come during a restart wait instead of being refused.
  Descriptor TakeSocket(const std::string& name);
  /// Every one under this name that is not taken yet.
  std::vector<Descriptor> TakeSockets(const std::string& name);

  /// Hands it descriptors to keep under this name, and closes them here; whoever is started after
  /// this process, however that ended, takes them with TakeSockets(). A connection that is shut
  /// down it lets go by itself [sd_pid_notify_with_fds(3), FDSTORE=1].
  void Keep(const std::string& name, std::vector<Descriptor> descriptors) const;

 private:
  bool listens_ = false;
  std::optional<double> feed_period_s_;
  struct Held {
    std::string name;
    Descriptor descriptor;
  };
  std::vector<Held> held_;
};

}  // namespace plumbline
