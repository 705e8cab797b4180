// Servers compared by the Modbus benchmark, each in a separate process.
#pragma once

#include <sys/types.h>

namespace plumbline::bench {

enum class ServerKind {
  kPlumbline,        ///< our TcpServer with a register image
  kLibmodbus,        ///< modbus_receive / modbus_reply, one client at a time
  kLibmodbusSelect,  ///< same with select(), as in libmodbus's example
  kEcho,             ///< bare echo server with epoll
};

/// Registers 0..199 are readable; register k holds n + k, where n counts the publications.
class ServerProcess {
 public:
  /// @param cpu           CPU it is pinned to; negative: any
  /// @param publish_hz    rate at which a writer publishes new images (kPlumbline only); 0: never
  explicit ServerProcess(ServerKind kind, int cpu = -1, int publish_hz = 0);
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  int port() const { return port_; }

 private:
  pid_t pid_ = -1;
  int port_ = 0;
  int life_fd_ = -1;  ///< closing it ends the child
};

/// Pins this process to one CPU; negative: restores the affinity it had at start.
void PinToCpu(int cpu);

/// Last CPU that this process may use.
int LastCpu();

}  // namespace plumbline::bench
