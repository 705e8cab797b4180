// The servers that the Modbus benchmark compares, each in a process of its own.
#pragma once

#include <sys/types.h>

namespace plumbline::bench {

enum class ServerKind {
  kPlumbline,        ///< the product's TcpServer over an image
  kLibmodbus,        ///< modbus_receive / modbus_reply, one client at a time
  kLibmodbusSelect,  ///< the same behind select(), as libmodbus's own example has it
  kEcho,             ///< epoll, what comes goes back
};

/// Registers 0..199 are readable; register k holds n + k, where n counts the publications.
class ServerProcess {
 public:
  /// @param cpu           the core it is pinned to; negative: any
  /// @param publish_hz    rate at which a writer publishes new images (kPlumbline only); 0: never
  explicit ServerProcess(ServerKind kind, int cpu = -1, int publish_hz = 0);
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  int port() const { return port_; }

 private:
  pid_t pid_ = -1;
  int port_ = 0;
  int life_fd_ = -1;  ///< closed: the child ends
};

/// Keeps this process on one core; negative: gives it all back that it had at the start.
void PinToCpu(int cpu);

/// The last core that this process may use.
int LastCpu();

}  // namespace plumbline::bench
