// Modbus RTU slave on a serial line that may be shared with other slaves.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <thread>

#include "drivers/modbus/adu.h"
#include "drivers/modbus/request_handler.h"
#include "drivers/os/descriptor.h"
#include "drivers/thread_heartbeat.h"
#include "firmware-like/result.h"

namespace plumbline::modbus {

struct RtuSlaveOptions {
  std::string device;  ///< for example /dev/ttyUSB0
  int baud = 19200;    ///< 1200 to 115200, a standard rate
  char parity = 'E';   ///< 'N', 'E' or 'O'
  int stop_bits = 1;
  std::uint8_t unit_id = 1;  ///< 1..247
  /// Silence after which an incomplete frame is discarded [s]; USB adapters deliver frames in
  /// pieces.
  double frame_timeout_s = 0.02;
  /// Called in the slave's thread when the line is lost or cannot be opened (with the reason and
  /// the remedy), and when it is restored (with an empty text).
  std::function<void(const std::string& lost_because)> on_change{};
};

struct RtuSlaveCounters {
  std::uint64_t requests = 0;    ///< to this unit, including broadcasts
  std::uint64_t broadcasts = 0;  ///< executed but never answered
  std::uint64_t discarded = 0;   ///< fragments without a valid checksum
  std::uint64_t openings = 0;    ///< times the device was opened
};

/// Runs one thread. A request is handled once the line has been silent for 3.5 characters, which
/// also keeps the required gap before the response. It is answered only if no bytes have followed
/// it: a master that has already sent another request would take a late response for the response
/// to that one. A missing or lost device is reopened after 0.1 s, 0.2 s, up to 1 s.
class RtuSlave {
 public:
  /// @return the slave, or which setting is invalid; a missing device is not an error
  static Result<std::unique_ptr<RtuSlave>> Start(const RtuSlaveOptions& options,
                                                 RequestHandler& handler);
  ~RtuSlave();
  RtuSlave(const RtuSlave&) = delete;
  RtuSlave& operator=(const RtuSlave&) = delete;

  /// May be called from any thread.
  RtuSlaveCounters counters() const;
  const ThreadHeartbeat& heartbeat() const { return heartbeat_; }

 private:
  RtuSlave(const RtuSlaveOptions& options, RequestHandler& handler);
  void Run();
  bool OpenDevice();
  bool SleepUnlessStopped(double time_s);
  void ServeUntilLost();
  bool ReadBytes();
  void HandleFrames();
  void WriteReply(std::span<const std::uint8_t> reply) const;
  void Disconnect(const std::string& reason);

  struct AtomicCounters {
    std::atomic<std::uint64_t> requests{0}, broadcasts{0}, discarded{0}, openings{0};
  };

  const RtuSlaveOptions options_;
  const double silence_s_;
  RequestHandler& handler_;
  RtuReceiver receiver_;
  os::Descriptor line_, stop_;
  bool loss_reported_ = false;
  AtomicCounters counters_;
  ThreadHeartbeat heartbeat_;
  std::thread thread_;
};

}  // namespace plumbline::modbus
