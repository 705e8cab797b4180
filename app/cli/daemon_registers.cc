#include "app/cli/daemon_registers.h"

#include <fmt/format.h>
#include <modbus/modbus.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <memory>

#include "drivers/plc/codec.h"
#include "drivers/robot/host_name.h"

namespace plumbline::cli {
namespace {

/// How a server that is not plumblined replied to the first request.
/// @param error  errno of libmodbus
std::string UnexpectedReplyText(int error) {
  if (error == ETIMEDOUT) return "it does not respond";
  if (error == ECONNRESET || error == EPIPE) {
    return "it closes the connection (another program, or plc.allow does not list this computer)";
  }
  if (error >= EMBXILFUN && error <= EMBXGTAR) return "its Modbus registers are not plumblined's";
  return "it does not speak Modbus";
}

}  // namespace

Result<DaemonRegisters> DaemonRegisters::Read(const std::string& host, int port) {
  const std::string place = fmt::format("{}:{}", host, port);
  if (const char* why = robot::ResolveFailure(host)) {
    return Error{fmt::format("{}: unknown host name ({}); check --host", place, why)};
  }
  const std::unique_ptr<modbus_t, decltype(&modbus_free)> link(
      modbus_new_tcp_pi(host.c_str(), std::to_string(port).c_str()), &modbus_free);
  if (!link || modbus_connect(link.get()) != 0) {
    return Error{
        fmt::format("{}: {}; check that plumblined is running and that host and port match "
                    "plc.listen and plc.port",
                    place, modbus_strerror(errno))};
  }
  DaemonRegisters daemon;
  const auto read = [&](int first, int count) {
    const auto end = static_cast<std::size_t>(first) + static_cast<std::size_t>(count);
    daemon.registers_.resize(std::max(daemon.registers_.size(), end));
    return modbus_read_registers(link.get(), first, count, daemon.registers_.data() + first) ==
           count;
  };
  bool ok = read(0, plc::registers::kStateSize);
  if (ok && daemon.registers_[0] != plc::registers::kMagic) errno = EMBXILADD;
  if (!ok || daemon.registers_[0] != plc::registers::kMagic) {
    return Error{fmt::format("{}: another server is listening there: {}; {}", place,
                             UnexpectedReplyText(errno),
                             "set --host and --port to the daemon's plc.listen and plc.port")};
  }
  ok = ok && read(plc::registers::kInputs, plc::registers::kInputsSize);
  ok = ok && read(plc::registers::kMonitoring, plc::registers::kMonitoringSize);
  for (int k = 0; ok && k < static_cast<int>(model::kMaxCameras); ++k) {
    const int further = plc::registers::kCameraStride * k;
    ok = read(plc::registers::kCamera + further, plc::registers::kCameraSize) &&
         read(plc::registers::kBodies + further,
              plc::registers::kBodySize * static_cast<int>(status::CameraStatus::kMaxBodies));
    if (ok && daemon.Camera("camera_state", k) > 0) daemon.cameras_ = k + 1;
  }
  ok = ok && read(plc::registers::kScene, plc::registers::kSceneSize);
  ok = ok && read(plc::registers::kMotionLink, plc::registers::kMotionLinkSize);
  for (int k = 0; ok && k < static_cast<int>(status::kMaxGauges); ++k) {
    ok = read(plc::registers::kGauges + plc::registers::kGaugeSize * k, plc::registers::kGaugeSize);
    if (ok && daemon.Gauge("gauge_state", k) > 0) daemon.gauges_ = k + 1;
  }
  for (int k = 0; ok && k < daemon.points(); ++k) {
    ok = read(plc::registers::kPoints + plc::registers::kPointSize * k, plc::registers::kPointSize);
  }
  // A daemon of an earlier version has no posture blocks and rejects the first request.
  daemon.postures_ = ok && daemon.points() > 0;
  for (int k = 0; ok && daemon.postures_ && k < daemon.points(); ++k) {
    daemon.postures_ = read(plc::registers::kPostures + plc::registers::kPostureSize * k,
                            plc::registers::kPostureSize);
    ok = daemon.postures_ || errno == EMBXILADD;
  }
  const int error = errno;
  modbus_close(link.get());
  if (!ok) return Error{fmt::format("{}: {}", place, modbus_strerror(error))};
  return daemon;
}

std::string DaemonRegisters::CameraName(int camera) const {
  const auto name = static_cast<std::size_t>(Camera("camera_name", camera));
  return name < status::kCameraNames.size() ? status::kCameraNames[name] : "";
}

std::string DaemonRegisters::GaugeName(int gauge) const {
  std::string name;
  for (const plc::MapField& field : plc::registers::GaugeFields()) {
    if (!std::string_view(field.name).starts_with("gauge_name_")) continue;
    const auto word = static_cast<unsigned>(Gauge(field.name, gauge));
    for (const unsigned code : {word >> 8U, word & 0xFFU}) {  // two characters in a register
      if (code != 0) name += static_cast<char>(code);
    }
  }
  return name;
}

bool DaemonRegisters::HasGaugeReading(int gauge) const {
  constexpr double kNoReading_ms = 4294967295;
  return Gauge("gauge_age", gauge) < kNoReading_ms;
}

double DaemonRegisters::Find(std::span<const plc::MapField> fields, std::string_view name,
                             int base) const {
  for (const plc::MapField& field : fields) {
    if (name == field.name) {
      return plc::ValueOfField(field.type, registers_,
                               static_cast<std::size_t>(base) + field.address, registers_[2] == 1);
    }
  }
  assert(false && "no such field");
  return 0;
}

}  // namespace plumbline::cli
