#include "app/cli/doctor/cell.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "app/cell/view_link/view_client.h"
#include "app/plant/broker_link.h"
#include "drivers/clock.h"
#include "drivers/display/registry.h"
#include "drivers/hid/hid_device.h"
#include "drivers/hid/keyboard_grab.h"
#include "drivers/plc/register_map.h"
#include "drivers/robot/registry.h"

namespace plumbline::cli {
namespace {

constexpr double kStateWait_s = 2, kRobotWait_s = 3, kBrokerWait_s = 5;

CheckResult CheckDevice(const std::string& subject, const std::string& path, const Account& account,
                        const char* remedy) {
  const std::string problem = AccessProblem(account, path, true);
  if (problem.empty()) return {Health::kGood, subject, path, {}};
  return {Health::kFault, subject, problem, remedy};
}

CheckResult ReadRobotOnce(const config::DaemonConfig& config) {
  const config::RobotLinkConfig& link = config.robot;
  if (link.transport == "replay") {
    return {Health::kNotChecked, "robot", "recording " + link.replay_file, {}};
  }
  const std::string place = link.transport == "rtu" ? link.connection.serial.device
                                                    : fmt::format("{}:{}", link.connection.tcp.host,
                                                                  link.connection.tcp.port);
  auto robot = robot::MakeRobot(link.transport, link.connection);
  if (!robot) return {Health::kFault, "robot", robot.error(), "fix [robot] in the configuration"};
  model::RobotState state;
  const double until_s = MonotonicSeconds() + kRobotWait_s;
  robot::LinkResult result = robot::LinkResult::kWaiting, failed = result;
  std::string problem;
  while (result != robot::LinkResult::kOk && MonotonicSeconds() < until_s) {
    result = robot.value()->Read(state);
    if (result != robot::LinkResult::kOk && result != robot::LinkResult::kWaiting) {
      problem = robot.value()->problem();
      failed = result;
    }
    if (result != robot::LinkResult::kOk) SleepSeconds(0.02);
  }
  if (result == robot::LinkResult::kOk) {
    return {
        Health::kGood, "robot", fmt::format("{} answers, {} joints", place, state.q.size()), {}};
  }
  const std::string_view remedy = robot::LinkRemedy(failed);
  return {Health::kFault, "robot", problem.empty() ? place + " does not answer" : problem,
          remedy.empty() ? "check robot.host" : std::string(remedy)};
}

/// Every file that the driver opens: the hidraw device, and the input devices on which it types.
CheckResult CheckHidGauge(const std::string& subject, const hid::HidName& name,
                          const Account& account) {
  const std::vector<std::string> paths = hid::DeviceFilesOf(name);
  if (paths.empty()) {
    return {Health::kFault, subject, NameText(name) + " is not connected",
            "plug it in; lsusb shows the ids"};
  }
  for (const std::string& path : paths) {
    const std::string problem = AccessProblem(account, path, path.starts_with("/dev/hidraw"));
    if (problem.empty()) continue;
    return {Health::kFault, subject, problem,
            "grant the group plumbline access to its hidraw and input devices by a udev rule such "
            "as those in 65-plumbline.rules, then plug it in again"};
  }
  return {Health::kGood, subject, fmt::format("{} at {}", NameText(name), paths.front()), {}};
}

/// The alarms and warnings of a daemon state, one result each.
CheckResults AlarmResults(const cell::ViewState& state) {
  CheckResults found;
  for (const plc::BitMeaning& bit : plc::registers::AlarmBits()) {
    if ((state.alarms & bit.mask) == 0) continue;
    found.push_back(
        {Health::kFault, "alarm", bit.meaning, "plumbline log --level error --explain"});
  }
  for (const plc::BitMeaning& bit : plc::registers::WarningBits()) {
    if ((state.warnings & bit.mask) == 0) continue;
    found.push_back(
        {Health::kWarning, "warning", bit.meaning, "plumbline log --level warning --explain"});
  }
  return found;
}

}  // namespace

CheckResult CheckPlcAccess(const modbus::TcpServerOptions& plc) {
  const std::string where = fmt::format("{} port {}", plc.address, plc.port);
  if (!plc.allow.empty()) {
    return {Health::kGood, "plc access",
            fmt::format("{}, open to {} only", where, fmt::join(plc.allow, ", ")), ""};
  }
  return {Health::kWarning, "plc access",
          where +
              ", or the port of plumbline.socket, accepts commands from every computer that can "
              "reach it",
          "set allow = [\"the PLC's address\"] under [plc], then systemctl restart plumbline"};
}

CheckResults CheckDaemon(const config::DaemonConfig& config) {
  cell::ViewClient client(cell::ViewSocketOf(config.state_directory));
  cell::View view;
  if (!client.Read(kStateWait_s, view)) {
    return {{Health::kWarning, "daemon", client.problem(),
             "systemctl start plumbline; if it is running, run the doctor as its user or as root "
             "(sudo)"},
            ReadRobotOnce(config)};
  }
  const cell::ViewState& state = view.state;
  const bool trusted = (state.status & status::kRobotLink) != 0;
  CheckResults found = {
      {Health::kGood,
       "daemon",
       fmt::format("plumblined {} is running, cell {}", state.version, state.cell),
       {}},
      {trusted ? Health::kGood : Health::kFault, "robot",
       trusted ? fmt::format("trusted, read {:.0f} ms ago", 1e3 * state.data_age_s)
       : state.robot_problem.empty() ? "the daemon has no trusted robot data"
                                     : state.robot_problem,
       trusted                      ? ""
       : state.robot_remedy.empty() ? "plumbline log --level error --explain; plumbline status"
                                    : state.robot_remedy}};
  const CheckResults alarms = AlarmResults(state);
  found.insert(found.end(), alarms.begin(), alarms.end());
  return found;
}

CheckResult CheckCamera(const config::CameraConfig& camera, const Account& account,
                        const camera::DeviceTree& tree) {
  if (camera.kind == "dv") {
    return CheckDevice("camera", camera.connection.dv.fifo, account,
                       "start the program that creates this FIFO and writes DV frames to it, such "
                       "as dvgrab");
  }
  if (camera.kind != "v4l2") return {Health::kNotChecked, "camera", "a recording", {}};
  const auto devices = camera::ListV4l2Devices(tree);
  const auto chosen = camera::SelectV4l2Device(camera.connection.v4l2.device, devices);
  if (!chosen) {
    return {Health::kFault, "camera", chosen.error(),
            "connect it; `plumbline cameras` lists the connected cameras and their names"};
  }
  if (!chosen->problem.empty()) {
    return {Health::kFault, "camera", fmt::format("{}: {}", chosen->path, chosen->problem),
            "fix the reported problem"};
  }
  CheckResult found =
      CheckDevice("camera", chosen->path, account, "add the user to the group video");
  if (found.health == Health::kGood)
    found.finding = fmt::format("{} at {}", chosen->name, chosen->path);
  return found;
}

CheckResult CheckZoomSensor(const config::ZoomConfig& zoom, const Account& account) {
  constexpr const char* kSubject = "zoom sensor";
  const zoom::ZoomKind* const kind = zoom::FindZoomKind(zoom.kind);
  if (kind == nullptr) return {Health::kNotChecked, kSubject, "none: a lens without zoom", {}};
  const Result<std::string> device = kind->device(zoom.connection);
  if (!device) return {Health::kFault, kSubject, device.error(), kind->remedy};
  if (!device->empty()) return CheckDevice(kSubject, *device, account, kind->remedy);
  return {Health::kNotChecked, kSubject, zoom.kind + ": visible to the daemon only", {}};
}

CheckResult CheckGauge(const config::GaugeConfig& gauge, const Account& account) {
  const std::string subject = "gauge " + gauge.artefact;
  if (gauge.connection.kind == gauge::GaugeKind::kHid) {
    return CheckHidGauge(subject, gauge.connection.hid, account);
  }
  return CheckDevice(
      subject, gauge.connection.device, account,
      "plug in its adapter; ls /dev/serial/by-id shows the name; add the user to the "
      "group dialout");
}

CheckResult CheckBroker(const config::MqttConfig& mqtt, const Account& account) {
  const auto fault = [](const std::string& finding, const std::string& remedy) {
    return CheckResult{Health::kFault, "broker", finding, remedy};
  };
  for (const std::string& file : {mqtt.tls_ca, mqtt.password_file}) {
    const std::string why = file.empty() ? "" : AccessProblem(account, file, false);
    if (!why.empty())
      return fault(why, "create the file and make it readable for the user " + account.name);
  }
  const std::string place = fmt::format("{}:{}", mqtt.host, mqtt.port);
  const auto tried = plant::TryBroker(mqtt, kBrokerWait_s);
  if (!tried) {
    return fault(
        fmt::format("{}: {}", place, tried.error()),
        "check that the broker is on, the cable plugged in, and host and port are correct. "
        "If it does not authorise: username and password_file. If TLS fails: tls_ca, and "
        "host as in the certificate");
  }
  return {Health::kGood, "broker", place + " accepts this computer", {}};
}

CheckResult CheckDisplay(const config::OverlayConfig& overlay, const Account& account) {
  if (overlay.display == config::OverlayConfig::Display::kNone) {
    return {Health::kNotChecked, "display", "none configured", {}};
  }
  const bool kms = overlay.display == config::OverlayConfig::Display::kKms;
  const std::string device = !overlay.device.empty() ? overlay.device
                             : kms                   ? display::KmsOptions{}.card
                                                     : display::FramebufferOptions{}.device;
  return CheckDevice("display", device, account,
                     "check that the driver is loaded (ls /dev/dri); add the user to the group "
                     "video");
}

}  // namespace plumbline::cli
