// The one cyclic thread: read the robot, compute, publish.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <thread>

#include "app/daemon/branch_preparation.h"
#include "app/daemon/loop_link.h"
#include "app/daemon/setup.h"
#include "app/service/utc_clock.h"
#include "drivers/lateness.h"
#include "drivers/latest.h"
#include "drivers/modbus/image_handler.h"
#include "drivers/plc/codec.h"
#include "drivers/pulse.h"
#include "drivers/robot/robot_link.h"

namespace plumbline {

/// Everything of one configuration that the cycle uses; replaced as a whole on reload.
struct CycleParts {
  CycleParts(const DaemonConfig& config, std::unique_ptr<RobotDevice> device, int version);
  /// @param kept  the link of the parts that these replace, which goes on
  CycleParts(const DaemonConfig& config, std::shared_ptr<RobotLink> kept, int version);

  Machine machine;
  BranchPreparation branches;    ///< of the machine's taught points; they are pending until found
  int model_version;             ///< of the machine's cell; 0: not known to the model store
  bool records_probes;           ///< [loop] enabled
  bool model_set_aside = false;  ///< an applied version is not in force
  PlcConvention convention;
  PlcEncoder encoder;
  std::shared_ptr<const modbus::AddressRanges> readable;
  RobotSetUp robot;                 ///< that the link was made from
  std::shared_ptr<RobotLink> link;  ///< shared only while one replaces the other
  double period_s;
  struct PushSlot {
    std::size_t point;  ///< index of the configured point
    int id;
  };
  std::vector<PushSlot> push;  ///< empty: nothing is pushed
};

/// What the loop tells beside the snapshots.
struct LoopCounters {
  std::uint64_t cycles = 0;
  std::uint32_t overruns = 0;
  double longest_cycle_s = 0;  ///< computation only, without the wait for the robot
  LatenessCounts starts;       ///< of cycles, against their ticks
};

/// What the PLC is told of this start, from its first request on.
PlcEnvironment EnvironmentAtStart(std::uint16_t boot_count, double period_s);

class CyclicLoop {
 public:
  /// @param handler  shared by the PLC transports; commands are read from it
  /// @param images   what it answers from
  /// @param link     where probes go
  CyclicLoop(std::unique_ptr<CycleParts> parts, modbus::ImageHandler& handler,
             Latest<modbus::RegisterImage>& images, LoopLink& link, std::uint16_t boot_count,
             const modbus::TcpServer* server);
  ~CyclicLoop();
  CyclicLoop(const CyclicLoop&) = delete;
  CyclicLoop& operator=(const CyclicLoop&) = delete;

  void Start();
  /// Ends the cycle and the robot link, which withdraws what it pushed.
  void Stop();

  /// Hands over a new configuration, which goes on from the values of the one before, and waits
  /// until its first cycle was published. With the same robot link, no point is withdrawn that the
  /// new model can correct: its points are solved before the cycle takes it over. A new robot link
  /// starts when the old one has withdrawn what it pushed: the slots may be others now.
  /// @param step  called every few milliseconds while the old link ends, which may take its
  /// time-outs
  void Replace(
      std::unique_ptr<CycleParts> parts, const std::function<void()>& step = [] {});

  /// The newest snapshot; at most kSnapshotReaders at a time.
  static constexpr int kSnapshotReaders = 2;
  Latest<Snapshot>::Guard ReadSnapshot() const { return snapshots_.Read(); }
  /// Alarm bits raised in any cycle since the last call.
  std::uint16_t TakeAlarms() { return alarms_.exchange(0); }
  LoopCounters counters() const;
  /// Raised by the cycle.
  const Pulse& pulse() const { return pulse_; }
  /// Of effects of time and of probes.
  const UtcClock& clock() const { return clock_; }
  /// Of the parts in force; only for the thread that calls Replace().
  const CycleParts& parts() const { return *parts_; }

 private:
  void Run();
  void OneCycle(CycleParts& parts, double tick_s);
  void EndLink(RobotLink& link, const std::function<void()>& step);
  void HandOver(const CycleParts& parts, const Snapshot& snapshot);
  void Publish(CycleParts& parts, const Snapshot& snapshot);

  std::unique_ptr<CycleParts> parts_;       ///< owned by the thread that calls Replace()
  std::atomic<CycleParts*> next_{nullptr};  ///< waiting to be taken over
  modbus::ImageHandler& handler_;
  Latest<modbus::RegisterImage>& images_;
  LoopLink& link_;
  Latest<Snapshot> snapshots_;
  PlcEnvironment environment_;
  const modbus::TcpServer* server_;
  const UtcClock clock_ = UtcClock::OfThisComputer();
  double start_s_ = 0;
  double last_overrun_s_ = -1e9;
  std::atomic<std::uint16_t> alarms_{0};
  std::atomic<std::uint64_t> cycles_{0};
  std::atomic<std::uint32_t> overruns_{0};
  std::atomic<double> longest_cycle_s_{0};
  Lateness starts_;
  Pulse pulse_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace plumbline
