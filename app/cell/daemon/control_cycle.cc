#include "app/cell/daemon/control_cycle.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

#include "app/base/log/log.h"
#include "app/measure/table/replay_file.h"
#include "app/version.h"
#include "drivers/plc/codec.h"
#include "drivers/real_time.h"
#include "firmware-like/cycle_status.h"

namespace plumbline::cell {
namespace {

constexpr std::size_t kMaxReplayWarnings = 10;

Result<robot::ReplayRows> ReplayFrom(const config::DaemonConfig& config) {
  config::FaultList faults;
  const std::optional<measure::MeasuredTable> table = measure::ReadReplayFile(config, faults);
  std::size_t warnings = 0;
  for (const config::Fault& fault : faults.All()) {
    const bool warning = fault.severity == config::Fault::Severity::kWarning;
    if (warning && ++warnings > kMaxReplayWarnings) continue;
    log::LogFault(fault);
  }
  if (warnings > kMaxReplayWarnings) {
    log::Log({log::Event::kFileWarning,
              fmt::format("{} more warnings about {}", warnings - kMaxReplayWarnings,
                          config.robot.replay_file)});
  }
  if (!table) return Error{fmt::format("{} cannot be replayed", config.robot.replay_file)};
  robot::ReplayRows replay = config.robot.connection.replay;
  for (const measure::MeasuredRow& row : table->rows) {
    robot::ReplayRow& replayed = replay.rows.emplace_back();
    replayed.q = row.q;
    replayed.payload_kg = row.payload_kg;
    replayed.temp_C = row.temp_C;
    replayed.tool_number = row.tool_number;
    replayed.payload_item = row.payload_item;
  }
  return replay;
}

}  // namespace

Result<RobotSetup> RobotSetupFrom(const config::DaemonConfig& config) {
  RobotSetup robot{config.robot.transport, config.robot.connection, config.push_ids};
  if (robot.transport == "replay") {
    Result<robot::ReplayRows> replay = ReplayFrom(config);
    if (!replay) return Error{replay.error()};
    robot.connection.replay = std::move(replay).value();
  }
  return robot;
}

std::shared_ptr<const modbus::AddressRanges> ReadableRanges(std::size_t points) {
  std::vector<modbus::AddressRanges::Range> ranges;
  // Registers between two entries of a window read as 0: a PLC reads a window in one request.
  const auto add = [&ranges](std::size_t first, std::size_t size) {
    ranges.push_back(
        {static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(first + size - 1)});
  };
  add(0, plc::registers::kStateSize);
  add(plc::registers::kResult, plc::registers::kResultSize + plc::registers::kResultMoreSize);
  add(plc::registers::kScaled, plc::registers::kScaledSize);
  add(plc::registers::kInputs, plc::registers::kInputsSize);
  add(plc::registers::kMonitoring, plc::registers::kMonitoringSize);
  for (std::size_t k = 0; k < model::kMaxCameras; ++k) {
    add(plc::registers::kCamera + plc::registers::kCameraStride * k, plc::registers::kCameraSize);
    add(plc::registers::kBodies + plc::registers::kCameraStride * k,
        plc::registers::kBodySize * status::CameraStatus::kMaxBodies);
  }
  add(plc::registers::kScene, plc::registers::kSceneSize);
  add(plc::registers::kMotionLink, plc::registers::kMotionLinkSize);
  add(plc::registers::kGauges, plc::registers::kGaugeSize * status::kMaxGauges);
  if (points > 0) {
    add(plc::registers::kPoints, plc::registers::kPointSize * points);
    add(plc::registers::kPostures, plc::registers::kPostureSize * points);
  }
  return std::make_shared<modbus::AddressRanges>(std::move(ranges));
}

modbus::CommandArea EmptyCommandArea() {
  modbus::CommandArea area;
  area.registers = {plc::registers::kCommands,
                    std::vector<std::uint16_t>(plc::registers::kCommandsSize)};
  area.coils = {plc::registers::kCoils, std::vector<std::uint8_t>(plc::registers::kCoilsSize)};
  constexpr std::uint16_t kHeartbeat = plc::CommandNamed("plc_heartbeat").address;
  area.non_command_registers = {kHeartbeat, kHeartbeat};
  return area;
}

namespace {

constexpr int kNice = 10;  // on Linux the nice value is per thread

}  // namespace

TaughtBranchSearch::TaughtBranchSearch(const MachineConfig& config)
    : searching_(config), branches_(config.points.size()) {}

TaughtBranchSearch::~TaughtBranchSearch() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

void TaughtBranchSearch::Start() {
  thread_ = std::thread([this] { Run(); });
  pthread_setname_np(thread_.native_handle(), "branches");
}

void TaughtBranchSearch::Run() {
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);
  for (std::size_t k = 0; k < branches_.size() && !stop_; ++k) {
    branches_[k] = searching_.FindTaughtBranch(k);
    found_.store(k + 1, std::memory_order_release);
  }
}

void TaughtBranchSearch::DeliverTo(Machine& machine, std::size_t max_count) {
  const std::size_t found = found_.load(std::memory_order_acquire);
  for (; delivered_ < found && max_count > 0; ++delivered_, --max_count) {
    machine.SetTaughtBranch(delivered_, branches_[delivered_]);
  }
}

namespace {

void SleepUntil(double monotonic_s) {
  timespec when{};
  when.tv_sec = static_cast<time_t>(monotonic_s);
  when.tv_nsec = static_cast<long>(1e9 * (monotonic_s - static_cast<double>(when.tv_sec)));
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, nullptr) == EINTR) {
  }
}

std::int64_t UnixMilliseconds() {
  using namespace std::chrono;
  return duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
}

/// steady_clock is CLOCK_MONOTONIC on Linux.
std::chrono::steady_clock::time_point TimePoint(double monotonic_s) {
  return std::chrono::steady_clock::time_point(
      std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 * monotonic_s)));
}

std::vector<std::uint16_t> PointIds(const config::DaemonConfig& config) {
  std::vector<std::uint16_t> ids;
  for (const correction::AssemblyPoint& point : config.machine.points) {
    ids.push_back(static_cast<std::uint16_t>(point.id));
  }
  return ids;
}

void SetBits(std::uint16_t word, std::size_t first, std::vector<std::uint8_t>& bits) {
  for (std::size_t k = 0; k < 16; ++k) bits[first + k] = (word >> k) & 1;
}

/// The last two bytes of an IPv4 or IPv6 address, the last one low.
std::uint16_t AddressEnd(const modbus::Client& client) {
  return static_cast<std::uint16_t>(client.address[14] << 8 | client.address[15]);
}

}  // namespace

CycleParts::CycleParts(const config::DaemonConfig& config,
                       std::unique_ptr<robot::RobotDevice> device, int version)
    : CycleParts(config, std::make_shared<robot::RobotLink>(std::move(device)), version) {}

CycleParts::CycleParts(const config::DaemonConfig& config, std::shared_ptr<robot::RobotLink> reused,
                       int version)
    : machine(config.machine),
      branches(config.machine),
      model_version(version),
      records_probes(config.monitoring.enabled),
      convention(config.plc.convention),
      encoder(convention, PointIds(config)),
      readable(ReadableRanges(config.machine.points.size())),
      link(std::move(reused)),
      period_s(config.cycle_period_s) {
  if (config.robot.connection.push.enabled) {
    for (const int id : config.push_ids) {
      for (std::size_t k = 0; k < config.machine.points.size(); ++k) {
        if (config.machine.points[k].id == id) push.push_back({k, id});
      }
    }
  }
  machine.MarkTaughtBranchesPending();
  branches.Start();
}

plc::PlcEnvironment EnvironmentAtStart(std::uint16_t boot_count, double period_s) {
  plc::PlcEnvironment environment;
  environment.boot_count = boot_count;
  environment.firmware =
      10000U * PLUMBLINE_VERSION_MAJOR + 100U * PLUMBLINE_VERSION_MINOR + PLUMBLINE_VERSION_PATCH;
  environment.cycle_period_s = period_s;
  return environment;
}

ControlCycle::ControlCycle(std::unique_ptr<CycleParts> parts, modbus::ImageHandler& handler,
                           Latest<modbus::RegisterImage>& images, CycleMailboxes& mailboxes,
                           std::uint16_t boot_count, const modbus::TcpServer* server)
    : parts_(std::move(parts)),
      handler_(handler),
      images_(images),
      mailboxes_(mailboxes),
      snapshots_(kSnapshotReaders, parts_->machine.Cycle({})),
      server_(server) {
  environment_ = EnvironmentAtStart(boot_count, parts_->period_s);
}

ControlCycle::~ControlCycle() {
  Stop();
}

void ControlCycle::Start() {
  start_s_ = MonotonicSeconds();
  parts_->link->Start();
  if (parts_->motion) {
    parts_->motion->UseModel(parts_->motion_model);
    parts_->motion->Start();
  }
  thread_ = std::thread([this] {
    SetRealTimePriority(kCyclePriority, "cycle");
    Run();
  });
}

void ControlCycle::Stop() {
  if (parts_->motion) parts_->motion->Stop();
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  parts_->link->Stop();
}

void ControlCycle::Replace(std::unique_ptr<CycleParts> parts, const std::function<void()>& step) {
  const bool link_kept = parts->link == parts_->link;
  const bool motion_kept = parts->motion == parts_->motion;
  if (parts_->motion && !motion_kept) StopMotion(*parts_->motion, step);
  if (link_kept) {
    const Snapshot last = *ReadSnapshot();
    parts->machine.Prepare(parts_->machine.config(), last, clock_.UtcAt(MonotonicSeconds()));
  }
  next_.store(parts.get());
  while (next_.load() != nullptr && !stop_) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (!link_kept) StopLink(*parts_->link, step);
  parts_ = std::move(parts);
  if (!link_kept) parts_->link->Start();
  if (!parts_->motion) return;
  parts_->motion->UseModel(parts_->motion_model);
  parts_->motion->Start();
}

void ControlCycle::StopMotion(motion_link::MotionLink& motion, const std::function<void()>& step) {
  motion.RequestStop();
  while (!motion.ended()) {
    step();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  motion.Stop();
}

void ControlCycle::StopLink(robot::RobotLink& link, const std::function<void()>& step) {
  link.RequestStop();
  while (!link.ended()) {
    step();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  link.Stop();
}

CycleCounters ControlCycle::counters() const {
  return {cycles_, overruns_, longest_cycle_s_, starts_.Counts()};
}

void ControlCycle::Run() {
  CycleParts* parts = parts_.get();
  double tick_s = MonotonicSeconds();
  while (!stop_) {
    CycleParts* const next = next_.load();
    if (next != nullptr) {
      next->machine.ResumeFrom(parts->machine, next->link == parts->link
                                                   ? Machine::RobotLinkContinuity::kKept
                                                   : Machine::RobotLinkContinuity::kNew);
      parts = next;
      environment_.cycle_period_s = parts->period_s;
    }
    heartbeat_.Beat();
    starts_.Add(MonotonicSeconds() - tick_s);
    RunOnce(*parts, tick_s);
    // From here on neither this thread nor the newest snapshot refers to the old parts.
    if (next != nullptr) next_.store(nullptr);
    tick_s += parts->period_s;
    const double now_s = MonotonicSeconds();
    if (now_s > tick_s) {
      overruns_.fetch_add(1);
      last_overrun_s_ = now_s;
      tick_s = now_s;
    }
    SleepUntil(tick_s);
  }
}

void ControlCycle::RunOnce(CycleParts& parts, double tick_s) {
  const MachineInput input = Gather(parts, tick_s);
  const Snapshot& snapshot = parts.machine.Cycle(input);
  Publish(parts, input, snapshot);
  cycles_.fetch_add(1, std::memory_order_relaxed);
  const double spent_s = MonotonicSeconds() - input.now_s;
  if (spent_s > longest_cycle_s_.load(std::memory_order_relaxed)) longest_cycle_s_ = spent_s;
}

MachineInput ControlCycle::Gather(CycleParts& parts, double tick_s) {
  parts.link->RequestRead();
  parts.link->WaitForState(TimePoint(tick_s + 0.5 * parts.period_s));
  MachineInput input;
  input.now_s = environment_.now_s = MonotonicSeconds();
  input.utc_s = clock_.UtcAt(input.now_s);
  input.unix_ms = UnixMilliseconds();
  input.robot = parts.link->Latest();
  input.cycle_overrun = input.now_s - last_overrun_s_ < 1.0;
  GatherCommand(parts, input);
  GatherBackground(parts, input);
  parts.branches.DeliverTo(parts.machine);
  return input;
}

void ControlCycle::Publish(CycleParts& parts, const MachineInput& input, const Snapshot& snapshot) {
  PublishOutcomes(parts, input, snapshot);
  PublishRegisters(parts, snapshot);
  snapshots_.Begin() = snapshot;
  snapshots_.Publish();
  alarms_.fetch_or(snapshot.alarms);
  PushPoints(parts, snapshot);
  ReportToMotion(parts, input, snapshot);
}

void ControlCycle::GatherCommand(const CycleParts& parts, MachineInput& input) {
  const auto commands = handler_.Commands();
  input.command = plc::PlcCommandFromRegisters(commands->registers.values, commands->coils.values,
                                               parts.convention);
  writer_ = commands->writer;
  const bool two_masters = input.now_s < commands->two_masters_until_s;
  environment_.masters.other = two_masters ? AddressEnd(commands->other) : std::uint16_t{0};
  if (two_masters) input.background_warnings |= warning::kTwoMasters;
}

void ControlCycle::GatherBackground(const CycleParts& parts, MachineInput& input) {
  status::MonitoringStatus& monitoring = environment_.monitoring;
  monitoring = *mailboxes_.monitoring.Read();
  const model::CellModel& cell = parts.machine.config().cell;
  monitoring.model.applied = parts.model_version;
  monitoring.model.fitted = cell.domain && cell.domain->as_validated;
  monitoring.model.effects = static_cast<int>(cell.effects.size());
  for (std::size_t k = 0; k < model::kMaxCameras; ++k) {
    environment_.cameras[k] = *mailboxes_.cameras[k].status.Read();
  }
  environment_.scene = *mailboxes_.scene.Read();
  environment_.gauges = *mailboxes_.gauges.status.Read();
  environment_.motion_link = parts.motion ? parts.motion->Status() : status::MotionLinkStatus();
  AddBackground(monitoring, environment_.cameras, environment_.scene, input);
  input.probes_recorded = monitoring.recording && mailboxes_.queue.HasRoom();
  input.probes_pending = parts.records_probes && !monitoring.settled;
  input.compensated_twice = mailboxes_.compensated_twice;
  if (parts.model_superseded) input.background_warnings |= warning::kModelSetAside;
  const GaugePress press = *mailboxes_.gauges.press.Read();
  const bool is_new = press.number > mailboxes_.gauges.handled >> 8U;
  if (is_new && input.now_s - press.time_s < kGaugePressValid_s) input.gauge = press;
}

void ControlCycle::PublishOutcomes(const CycleParts& parts, const MachineInput& input,
                                   const Snapshot& snapshot) {
  if (snapshot.command_executed) {
    environment_.masters.executed = AddressEnd(writer_);
    environment_.masters.executed_port = writer_.port;
  }
  if (snapshot.gauge_code) {
    mailboxes_.gauges.handled =
        std::uint64_t{input.gauge->number} << 8U | static_cast<std::uint8_t>(*snapshot.gauge_code);
  }
  const bool temperature_valid = (snapshot.status & status::kTemperatureValid) != 0;
  for (std::size_t k = 0; k < model::kMaxCameras; ++k) {
    vision::CameraLink& camera = mailboxes_.cameras[k];
    camera.temp_C = temperature_valid ? snapshot.robot.temp_C.value_or(NAN) : NAN;
    const CalibrationRequest order = snapshot.calibration_requests[k];
    if (order == CalibrationRequest::kStart) ++camera.start_board;
    if (order == CalibrationRequest::kCancel) ++camera.cancel_board;
  }
  if (!snapshot.probe_taken && !snapshot.monitor_restart) return;
  const bool by_gauge = snapshot.probe_taken && snapshot.probe.by_gauge;
  mailboxes_.queue.Push({snapshot.monitor_restart, snapshot.probe, parts.model_version,
                         by_gauge ? input.gauge->number : 0});
}

void ControlCycle::PublishRegisters(CycleParts& parts, const Snapshot& snapshot) {
  environment_.uptime_s = snapshot.now_s - start_s_;
  environment_.heartbeat =
      static_cast<std::uint16_t>(static_cast<std::uint64_t>(10 * environment_.uptime_s));
  environment_.clients =
      server_ != nullptr ? static_cast<std::uint16_t>(server_->counters().clients) : 0;
  environment_.overruns = overruns_;
  environment_.longest_cycle_s = longest_cycle_s_;

  modbus::RegisterImage& image = images_.Begin();
  image.readable = parts.readable;
  parts.encoder.Encode(snapshot, environment_);
  parts.encoder.CopyTo(image.registers);
  image.bits.resize(plc::registers::kBits);
  SetBits(snapshot.status, 0, image.bits);
  SetBits(snapshot.alarms, 16, image.bits);
  SetBits(snapshot.warnings, 32, image.bits);
  images_.Publish();
}

void ControlCycle::ReportToMotion(const CycleParts& parts, const MachineInput& input,
                                  const Snapshot& snapshot) {
  if (!parts.motion) return;
  motion_offset::CycleReport report;
  report.now_s = input.now_s;
  report.generation = parts.motion_model->generation;
  report.plc_alive = (snapshot.status & status::kPlcHeartbeatSeen) != 0;
  report.enabled = motion_switch_.Update(input.command.motion_enabled, report.plc_alive);
  report.compensated_twice = input.compensated_twice;
  report.robot_trusted =
      snapshot.input_fault == InputFault::kOk && (snapshot.alarms & alarm::kEmergencyStop) == 0;
  report.q = snapshot.robot.q;
  report.q_s = snapshot.robot.timestamp_s;
  if (snapshot.payload_valid) {
    report.payload = snapshot.payload;
    report.conditions = parts.machine.ConditionsOf(snapshot.payload);
  }
  report.radius = snapshot.present_radius;
  parts.motion->Report(report);
}

void ControlCycle::PushPoints(const CycleParts& parts, const Snapshot& snapshot) {
  if (parts.push.empty()) return;
  std::array<robot::PushPoint, robot::kMaxPushPoints> pushed;
  const std::size_t count = std::min(parts.push.size(), pushed.size());
  for (std::size_t slot = 0; slot < count; ++slot) {
    const PointResult& point = snapshot.points[parts.push[slot].point];
    const correction::Correction& found = point.correction;
    const bool has_radius = found.basis != model::RadiusBasis::kUnknown;
    pushed[slot] = {static_cast<int>(slot), parts.push[slot].id, found.X_BP_command, point.valid,
                    has_radius ? found.uncertainty_m : 0};
  }
  parts.link->QueuePush(std::span(pushed).first(count));
}

}  // namespace plumbline::cell
