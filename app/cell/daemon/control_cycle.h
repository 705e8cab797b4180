// The control cycle: a real-time thread that reads the robot, computes and publishes, once per
// period.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "app/base/config/daemon_config.h"
#include "app/base/service/utc_clock.h"
#include "app/cell/daemon/cycle_mailboxes.h"
#include "drivers/lateness.h"
#include "drivers/latest.h"
#include "drivers/modbus/image_handler.h"
#include "drivers/modbus/register_image.h"
#include "drivers/motion/motion_link.h"
#include "drivers/plc/codec.h"
#include "drivers/robot/robot_link.h"
#include "drivers/thread_heartbeat.h"
#include "firmware-like/machine.h"

namespace plumbline::cell {

// Conversion of the configuration to the robot setup and the Modbus address ranges.

/// Everything that a robot link, and the push of points over it, is created from. If a reloaded
/// configuration has an equal setup, the running link is reused.
struct RobotSetup {
  std::string transport;
  robot::RobotConnection connection;  ///< including the rows of a replay
  std::vector<int> push_ids;

  bool operator==(const RobotSetup&) const = default;
};
/// Fails if a replay file has faults, which are logged.
Result<RobotSetup> RobotSetupFrom(const config::DaemonConfig& config);

/// The addresses of the register map that clients may read if there are this many points.
std::shared_ptr<const modbus::AddressRanges> ReadableRanges(std::size_t points);

/// The registers that clients may write, all zero.
modbus::CommandArea EmptyCommandArea();

// Background search for the inverse-kinematics branches of taught points.

/// Finds, for each point that was taught with joint values, the branch it belongs to. The points
/// are searched one after another on a separate low-priority thread, because a thousand points take
/// ten seconds. The control cycle takes results as they become available.
///
/// The thread works on its own Machine with the same configuration. Each result is written once,
/// before `found_` counts it, and only read afterwards: no locks, and the reader allocates nothing.
class TaughtBranchSearch {
 public:
  /// Branches delivered in one cycle: each requires a correction to be computed in that cycle.
  static constexpr std::size_t kMaxPerCycle = 2;

  explicit TaughtBranchSearch(const MachineConfig& config);
  ~TaughtBranchSearch();
  TaughtBranchSearch(const TaughtBranchSearch&) = delete;
  TaughtBranchSearch& operator=(const TaughtBranchSearch&) = delete;

  void Start();
  bool finished() const { return found_.load(std::memory_order_acquire) == branches_.size(); }

  /// Passes at most `max_count` new branches to the machine. One thread at a time.
  void DeliverTo(Machine& machine, std::size_t max_count = kMaxPerCycle);

 private:
  void Run();

  Machine searching_;
  std::vector<std::optional<model::JointVector>>
      branches_;  ///< one per point; the first found_ are final
  std::atomic<std::size_t> found_{0};
  std::size_t delivered_ = 0;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

/// Everything of one configuration that the cycle uses; replaced as a whole on reload.
struct CycleParts {
  CycleParts(const config::DaemonConfig& config, std::unique_ptr<robot::RobotDevice> device,
             int version);
  /// @param reused  the running link of the parts that this object replaces
  CycleParts(const config::DaemonConfig& config, std::shared_ptr<robot::RobotLink> reused,
             int version);

  Machine machine;
  TaughtBranchSearch branches;    ///< of the machine's taught points, which are pending until found
  int model_version;              ///< of the machine's cell; 0: not in the model store
  bool records_probes;            ///< whether [monitoring] is enabled
  bool model_superseded = false;  ///< whether an applied version is not in force
  plc::PlcConvention convention;
  plc::PlcEncoder encoder;
  std::shared_ptr<const modbus::AddressRanges> readable;
  RobotSetup robot;  ///< the setup that the link was created from
  std::shared_ptr<robot::RobotLink>
      link;  ///< shared only while one configuration replaces the other
  /// Corrections inside the motion, and the model for them; null if they are not configured. The
  /// link is shared only while one configuration replaces the other.
  std::shared_ptr<motion_link::MotionLink> motion;
  std::shared_ptr<const motion_offset::MotionModel> motion_model;
  double period_s;
  struct PushSlot {
    std::size_t point;  ///< index of the configured point
    int id;
  };
  std::vector<PushSlot> push;  ///< empty: no points are pushed
};

/// Timing statistics of the cycle since its start.
struct CycleCounters {
  std::uint64_t cycles = 0;
  std::uint32_t overruns = 0;
  double longest_cycle_s = 0;  ///< computation only, without the wait for the robot
  LatenessHistogram starts;    ///< of cycles, relative to their scheduled time
};

/// The registers that identify this start to the PLC, from its first request on.
plc::PlcEnvironment EnvironmentAtStart(std::uint16_t boot_count, double period_s);

class ControlCycle {
 public:
  /// @param handler    shared by the PLC transports; commands are read from it
  /// @param images     the register images that it answers from
  /// @param mailboxes  receives probes, delivers the status of monitoring, cameras and scene
  ControlCycle(std::unique_ptr<CycleParts> parts, modbus::ImageHandler& handler,
               Latest<modbus::RegisterImage>& images, CycleMailboxes& mailboxes,
               std::uint16_t boot_count, const modbus::TcpServer* server);
  ~ControlCycle();
  ControlCycle(const ControlCycle&) = delete;
  ControlCycle& operator=(const ControlCycle&) = delete;

  void Start();
  /// Lets the offset of a running motion return to 0, then stops the cycle and the robot link,
  /// which withdraws the points it has pushed.
  void Stop();

  /// Switches to a new configuration, which continues from the values of the previous one, and
  /// waits until its first cycle is published. With the same robot link, no point is withdrawn that
  /// the new model can correct: its points are solved before the switch. A new robot link starts
  /// after the old one has withdrawn its pushed points, because slots may have been reassigned.
  /// @param step  progress callback, called every few milliseconds while the old link stops, which
  ///              can take as long as its timeouts
  void Replace(
      std::unique_ptr<CycleParts> parts, const std::function<void()>& step = [] {});

  /// The newest snapshot; at most kSnapshotReaders may be held at a time.
  static constexpr int kSnapshotReaders = 2;
  Latest<Snapshot>::Guard ReadSnapshot() const { return snapshots_.Read(); }
  /// Alarm bits raised in any cycle since the last call.
  std::uint16_t TakeAlarms() { return alarms_.exchange(0); }
  CycleCounters counters() const;
  const ThreadHeartbeat& heartbeat() const { return heartbeat_; }
  /// The clock of probes and of time-dependent effects.
  const service::UtcClock& clock() const { return clock_; }
  /// The parts in use; only for the thread that calls Replace().
  const CycleParts& parts() const { return *parts_; }

 private:
  void Run();
  void RunOnce(CycleParts& parts, double tick_s);
  /// Reads the robot, waiting at most half a period for it, the PLC's command and the mailboxes.
  MachineInput Gather(CycleParts& parts, double tick_s);
  void GatherCommand(const CycleParts& parts, MachineInput& input);
  void GatherBackground(const CycleParts& parts, MachineInput& input);
  void Publish(CycleParts& parts, const MachineInput& input, const Snapshot& snapshot);
  /// Who wrote the command that was executed, the answer to a gauge, requests to the cameras, and a
  /// probe to the monitoring worker.
  void PublishOutcomes(const CycleParts& parts, const MachineInput& input,
                       const Snapshot& snapshot);
  void PublishRegisters(CycleParts& parts, const Snapshot& snapshot);
  void PushPoints(const CycleParts& parts, const Snapshot& snapshot);
  void ReportToMotion(const CycleParts& parts, const MachineInput& input, const Snapshot& snapshot);
  void StopMotion(motion_link::MotionLink& motion, const std::function<void()>& step);
  void StopLink(robot::RobotLink& link, const std::function<void()>& step);

  std::unique_ptr<CycleParts> parts_;       ///< owned by the thread that calls Replace()
  std::atomic<CycleParts*> next_{nullptr};  ///< to be used from the next cycle on
  modbus::ImageHandler& handler_;
  Latest<modbus::RegisterImage>& images_;
  CycleMailboxes& mailboxes_;
  Latest<Snapshot> snapshots_;
  plc::PlcEnvironment environment_;  ///< of this cycle
  modbus::Client writer_;            ///< of the command in this cycle
  const modbus::TcpServer* server_;
  const service::UtcClock clock_ = service::UtcClock::FromSystemClock();
  double start_s_ = 0;
  double last_overrun_s_ = -1e9;
  motion_offset::MotionSwitch motion_switch_;
  std::atomic<std::uint16_t> alarms_{0};
  std::atomic<std::uint64_t> cycles_{0};
  std::atomic<std::uint32_t> overruns_{0};
  std::atomic<double> longest_cycle_s_{0};
  LatenessRecorder starts_;
  ThreadHeartbeat heartbeat_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace plumbline::cell
