// Modbus RTU slave on a serial line, which other slaves may share.
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
  int baud = 19200;    ///< 1200 to 115200, one of the usual steps
  char parity = 'E';   ///< 'N', 'E' or 'O'
  int stop_bits = 1;
  std::uint8_t unit_id = 1;  ///< 1..247
  /// Silence after which an incomplete frame is given up; USB adapters deliver a frame in pieces.
  double patience_s = 0.02;
  /// Called in the slave's thread when the line is lost or cannot be opened (with the
  /// reason and what to do), and when it is restored (empty).
  std::function<void(const std::string& lost_because)> on_change{};
};

struct RtuSlaveCounters {
  std::uint64_t requests = 0;    ///< to this unit, broadcasts included
  std::uint64_t broadcasts = 0;  ///< executed, never answered
  std::uint64_t discarded = 0;   ///< pieces without a right check sum
  std::uint64_t openings = 0;    ///< of the device
};

/// One thread. A request is handled when the line has been silent for 3.5 characters, so the answer
/// keeps its distance, and answered only if nothing has followed it: a master that has already gone
/// on would take a late answer for another one. A device that is missing or lost is opened again
/// and again, at first after 0.1 s, later every second.
class RtuSlave {
 public:
  /// @return the slave, or which setting is wrong; a missing device is no error
  static Result<std::unique_ptr<RtuSlave>> Start(const RtuSlaveOptions& options,
                                                 RequestHandler& handler);
  ~RtuSlave();
  RtuSlave(const RtuSlave&) = delete;
  RtuSlave& operator=(const RtuSlave&) = delete;

  /// Any thread.
  RtuSlaveCounters counters() const;
  const Pulse& heartbeat() const { return pulse_; }

 private:
  RtuSlave(const RtuSlaveOptions& options, RequestHandler& handler);
  void Run();
  bool OpenDevice();
  bool SleepUnlessStopped(double time_s);
  void ServeUntilLost();
  bool ReadBytes();
  void HandleFrames();
  void WriteReply(std::span<const std::uint8_t> reply) const;
  void Lost(const std::string& reason);

  struct AtomicCounters {
    std::atomic<std::uint64_t> requests{0}, broadcasts{0}, discarded{0}, openings{0};
  };

  const RtuSlaveOptions options_;
  const double silence_s_;
  RequestHandler& handler_;
  RtuReceiver receiver_;
  Descriptor line_, stop_;
  bool told_lost_ = false;
  AtomicCounters counters_;
  Pulse pulse_;
  std::thread thread_;
};

}  // namespace plumbline::modbus
