#include "app/doctor/cell.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>

#include "app/fleet/broker_link.h"
#include "app/view_link/view_client.h"
#include "drivers/clock.h"
#include "drivers/display/registry.h"
#include "drivers/plc/register_map.h"
#include "drivers/robot/registry.h"

namespace plumbline {
namespace {

constexpr double kStateWait_s = 2, kRobotWait_s = 3, kBrokerWait_s = 5;
constexpr mode_t kOthersMayRead = 0004;

CheckedThing DeviceOf(const char* what, const std::string& path, const Account& account,
                      const char* remedy) {
  const std::string why = WhyNoAccess(account, path, true);
  if (why.empty()) return {Health::kGood, what, path, {}};
  return {Health::kFault, what, why, remedy};
}

CheckedThing AskRobot(const DaemonConfig& config) {
  const RobotLinkConfig& link = config.robot;
  if (link.transport == "replay") {
    return {Health::kNotLooked, "robot", "played from " + link.replay_file, {}};
  }
  const std::string place = link.transport == "rtu" ? link.connection.serial.device
                                                    : fmt::format("{}:{}", link.connection.tcp.host,
                                                                  link.connection.tcp.port);
  auto robot = MakeRobot(link.transport, link.connection);
  if (!robot) return {Health::kFault, "robot", robot.error(), "mend [robot] of the configuration"};
  RobotState state;
  const double until_s = MonotonicSeconds() + kRobotWait_s;
  LinkResult result = LinkResult::kWaiting;
  std::string problem;
  while (result != LinkResult::kOk && MonotonicSeconds() < until_s) {
    result = robot.value()->Read(state);
    if (result != LinkResult::kOk && result != LinkResult::kWaiting) {
      problem = robot.value()->problem();
    }
    if (result != LinkResult::kOk) SleepSeconds(0.02);
  }
  if (result == LinkResult::kOk) {
    return {
        Health::kGood, "robot", fmt::format("{} answers, {} joints", place, state.q.size()), {}};
  }
  return {Health::kFault, "robot", problem.empty() ? place + " does not answer" : problem,
          "is the controller on, its Modbus server enabled, the cable in, host, port and unit_id "
          "right?"};
}

/// What the alarms of a state say, each with its words.
CheckUp AlarmsOf(const ViewState& state) {
  CheckUp found;
  for (const BitMeaning& bit : plc_map::AlarmBits()) {
    if ((state.alarms & bit.mask) == 0) continue;
    found.push_back(
        {Health::kFault, "alarm", bit.meaning, "plumbline log --level error --explain"});
  }
  for (const BitMeaning& bit : plc_map::WarningBits()) {
    if ((state.warnings & bit.mask) == 0) continue;
    found.push_back(
        {Health::kWarning, "warning", bit.meaning, "plumbline log --level warning --explain"});
  }
  return found;
}

}  // namespace

CheckedThing LookAtAccess(const modbus::TcpServerOptions& plc) {
  const std::string where = fmt::format("{} port {}", plc.address, plc.port);
  if (!plc.allow.empty()) {
    return {Health::kGood, "plc access",
            where + ", for " + fmt::format("{}", fmt::join(plc.allow, ", ")), ""};
  }
  return {Health::kWarning, "plc access",
          where +
              ", or that of plumbline.socket, for every computer that reaches it: each may give "
              "commands",
          "allow = [\"the PLC's address\"] under [plc], then systemctl restart plumbline"};
}

CheckUp LookAtDaemon(const DaemonConfig& config) {
  ViewClient client(ViewSocketOf(config.state_directory));
  View view;
  if (!client.Read(kStateWait_s, view)) {
    return {{Health::kWarning, "daemon", client.problem(),
             "systemctl start plumbline; where it runs, ask as its user or as root (sudo)"},
            AskRobot(config)};
  }
  const ViewState& state = view.state;
  const bool trusted = (state.status & status::kRobotLink) != 0;
  CheckUp found = {{Health::kGood,
                    "daemon",
                    fmt::format("plumblined {} runs, cell {}", state.version, state.cell),
                    {}},
                   {trusted ? Health::kGood : Health::kFault, "robot",
                    trusted ? fmt::format("trusted, read {:.0f} ms ago", 1e3 * state.data_age_s)
                            : "the daemon has no trusted reading",
                    trusted ? "" : "plumbline log --level error --explain; plumbline status"}};
  const CheckUp alarms = AlarmsOf(state);
  found.insert(found.end(), alarms.begin(), alarms.end());
  return found;
}

CheckedThing LookAtCamera(const CameraConfig& camera, const Account& account,
                          const DeviceTree& tree) {
  if (camera.kind != "v4l2") return {Health::kNotLooked, "camera", "a recording", {}};
  const auto devices = ListV4l2Devices(tree);
  const auto chosen = SelectV4l2Device(camera.connection.v4l2.device, devices);
  if (!chosen) {
    return {Health::kFault, "camera", chosen.error(),
            "plug it in; `plumbline cameras` shows what is here, and by which name"};
  }
  if (!chosen->problem.empty()) {
    return {Health::kFault, "camera", fmt::format("{}: {}", chosen->path, chosen->problem),
            "what it says"};
  }
  CheckedThing found = DeviceOf("camera", chosen->path, account, "add the user to the group video");
  if (found.health == Health::kGood)
    found.told = fmt::format("{} at {}", chosen->name, chosen->path);
  return found;
}

CheckedThing LookAtZoom(const ZoomConfig& zoom, const Account& account) {
  constexpr const char* kWhat = "zoom sensor";
  const ZoomKind* const kind = FindZoomKind(zoom.kind);
  if (kind == nullptr) return {Health::kNotLooked, kWhat, "none: a lens without zoom", {}};
  const Result<std::string> device = kind->device(zoom.connection);
  if (!device) return {Health::kFault, kWhat, device.error(), kind->remedy};
  if (!device->empty()) return DeviceOf(kWhat, *device, account, kind->remedy);
  return {Health::kNotLooked, kWhat, zoom.kind + ": seen by the daemon only", {}};
}

CheckedThing LookAtBroker(const MqttConfig& mqtt, const Account& account) {
  const auto fault = [](const std::string& told, const std::string& remedy) {
    return CheckedThing{Health::kFault, "broker", told, remedy};
  };
  for (const std::string& file : {mqtt.tls_ca, mqtt.password_file}) {
    const std::string why = file.empty() ? "" : WhyNoAccess(account, file, false);
    if (!why.empty())
      return fault(why, "give the file, and let the user " + account.name + " read it");
  }
  const std::string place = fmt::format("{}:{}", mqtt.host, mqtt.port);
  const auto tried = TryBroker(mqtt, kBrokerWait_s);
  if (!tried) {
    return fault(fmt::format("{}: {}", place, tried.error()),
                 "is it on, the cable in, host and port right? not authorised: username and "
                 "password_file; TLS: tls_ca, and the host as the certificate names it");
  }
  struct stat about {};
  if (!mqtt.password_file.empty() && stat(mqtt.password_file.c_str(), &about) == 0 &&
      (about.st_mode & kOthersMayRead) != 0) {
    return {Health::kWarning, "broker", mqtt.password_file + " may be read by everybody",
            fmt::format("chown root:{0} {1} && chmod 640 {1}", account.name, mqtt.password_file)};
  }
  return {Health::kGood, "broker", place + " lets this computer in", {}};
}

CheckedThing LookAtDisplay(const OverlayConfig& overlay, const Account& account) {
  if (overlay.display == OverlayConfig::Display::kNone) {
    return {Health::kNotLooked, "display", "none configured", {}};
  }
  const bool kms = overlay.display == OverlayConfig::Display::kKms;
  const std::string device = !overlay.device.empty() ? overlay.device
                             : kms                   ? KmsOptions{}.card
                                                     : FramebufferOptions{}.device;
  return DeviceOf("display", device, account,
                  "is the driver loaded (ls /dev/dri)? add the user to the group video");
}

}  // namespace plumbline
