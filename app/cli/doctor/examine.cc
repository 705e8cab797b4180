#include "app/cli/doctor/examine.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <thread>

#include "app/base/config/daemon_config_reader.h"
#include "app/base/service/utc_clock.h"
#include "app/base/text/text.h"
#include "app/cell/journal/journal.h"
#include "app/cell/model_store/usable_model.h"
#include "app/cell/view_link/view_client.h"
#include "app/cli/doctor/robot_reading.h"
#include "app/plant/broker/broker_link.h"
#include "drivers/clock.h"
#include "drivers/display/registry.h"
#include "drivers/files/package_paths.h"
#include "drivers/hid/hid_device.h"
#include "drivers/hid/keyboard_grab.h"
#include "drivers/plc/register_map.h"

namespace plumbline::cli {
namespace {

constexpr mode_t kRead = 4, kWrite = 2, kSearch = 1;

bool Allows(const struct stat& file, const Account& account, mode_t wanted) {
  if (account.user == 0) return true;
  const bool in_group =
      std::find(account.groups.begin(), account.groups.end(), file.st_gid) != account.groups.end();
  const unsigned shift = file.st_uid == account.user ? 6 : in_group ? 3 : 0;
  return ((file.st_mode >> shift) & wanted) == wanted;
}

std::string OwnerText(const struct stat& file) {
  const passwd* const user = getpwuid(file.st_uid);
  const group* const of_group = getgrgid(file.st_gid);
  return fmt::format("{}:{} {:03o}", user != nullptr ? user->pw_name : std::to_string(file.st_uid),
                     of_group != nullptr ? of_group->gr_name : std::to_string(file.st_gid),
                     file.st_mode & 0777);
}

}  // namespace

Account AccountByName(const std::string& name) {
  const passwd* found = getpwnam(name.c_str());
  if (found == nullptr) found = getpwuid(geteuid());
  if (found == nullptr) return {std::to_string(geteuid()), geteuid(), {getegid()}};
  Account account{found->pw_name, found->pw_uid, {}};
  int count = 64;
  account.groups.resize(static_cast<std::size_t>(count));
  if (getgrouplist(found->pw_name, found->pw_gid, account.groups.data(), &count) < 0) {
    account.groups.resize(static_cast<std::size_t>(count));
    getgrouplist(found->pw_name, found->pw_gid, account.groups.data(), &count);
  }
  account.groups.resize(static_cast<std::size_t>(count));
  return account;
}

std::string AccessProblem(const Account& account, const std::string& path, bool write) {
  std::error_code unknown;
  const std::filesystem::path place = std::filesystem::weakly_canonical(path, unknown);
  std::filesystem::path above;
  for (const std::filesystem::path& part : place.parent_path()) {
    above /= part;
    struct stat folder {};
    if (stat(above.c_str(), &folder) != 0) {
      return fmt::format("{}: {}", above.string(), std::strerror(errno));
    }
    if (!Allows(folder, account, kSearch)) {
      return fmt::format("{} ({}) may not be entered by {}", above.string(), OwnerText(folder),
                         account.name);
    }
  }
  struct stat file {};
  if (stat(place.c_str(), &file) != 0) {
    return fmt::format("{}: {}", place.string(), std::strerror(errno));
  }
  if (!Allows(file, account, write ? kRead | kWrite : kRead)) {
    return fmt::format("{} ({}) may not be {} by {}", place.string(), OwnerText(file),
                       write ? "read and written" : "read", account.name);
  }
  return {};
}

namespace {

constexpr double kStateWait_s = 2, kBrokerWait_s = 5, kZoomWait_s = 2;

CheckResult CheckDevice(const std::string& subject, const std::string& path, const Account& account,
                        const char* remedy) {
  const std::string problem = AccessProblem(account, path, true);
  if (problem.empty()) return {Health::kGood, subject, path, {}};
  return {Health::kFault, subject, problem, remedy};
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
  if ((state.status & status::kCompensatedTwice) != 0) {
    found.push_back({Health::kFault, "controller",
                     "its tool pose contains what this cell corrects as well: points are corrected "
                     "twice",
                     "plumbline log --event compensated-twice --explain"});
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

CheckResults CheckDaemon(const config::DaemonConfig& config, bool& runs) {
  cell::ViewClient client(cell::ViewSocketOf(config.state_directory));
  cell::View view;
  const bool seen = client.Read(kStateWait_s, view);
  runs = seen || client.problem() != cell::kNotRunning;
  if (!runs) {
    return {{Health::kWarning, "daemon", client.problem(), "systemctl start plumbline"},
            CheckRobot(config)};
  }
  if (!seen) {
    return {{Health::kWarning, "daemon", client.problem(),
             "run the doctor as the daemon's user or as root (sudo); if that is of no use, "
             "systemctl restart plumbline"},
            {Health::kNotChecked, "robot", "only the daemon reads it while it runs", {}}};
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
  if (!trusted) {
    found.back().remedy +=
        "; or systemctl stop plumbline, and let plumbline doctor ask the controller itself";
  }
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

namespace {

/// Asks the sensor, as the daemon does.
CheckResult AskZoomSensor(const std::string& subject, const zoom::ZoomKind& kind,
                          const config::ZoomConfig& zoom) {
  const auto sensor = kind.make(zoom.connection);
  if (!sensor) return {Health::kFault, subject, sensor.error(), "fix [camera.zoom]"};
  const double give_up_s = MonotonicSeconds() + kZoomWait_s;
  do {
    lens::ZoomReading reading;
    if ((*sensor)->Read(reading) == zoom::ZoomResult::kOk) {
      return {Health::kGood,
              subject,
              fmt::format("{} answers, zoom at {} counts", kind.identity(zoom.connection),
                          reading.zoom_counts.value_or(0)),
              {}};
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  } while (MonotonicSeconds() < give_up_s);
  const std::string problem((*sensor)->problem());
  const std::size_t end = std::min(problem.find(". "), problem.size());  // of what happened
  return {Health::kFault, subject, problem.substr(0, end),
          problem.substr(std::min(end + 2, problem.size()))};
}

}  // namespace

CheckResult CheckZoomSensor(const config::ZoomConfig& zoom, const Account& account,
                            bool daemon_runs) {
  constexpr const char* kSubject = "zoom sensor";
  const zoom::ZoomKind* const kind = zoom::FindZoomKind(zoom.kind);
  if (kind == nullptr) return {Health::kNotChecked, kSubject, "none: a lens without zoom", {}};
  if (kind->in_network != nullptr && kind->in_network(zoom.connection)) {
    if (daemon_runs) {
      return {Health::kNotChecked,
              kSubject,
              kind->identity(zoom.connection) + ": only the daemon asks it while it runs",
              {}};
    }
    return AskZoomSensor(kSubject, *kind, zoom);
  }
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

namespace {

constexpr double kGiB = 1024.0 * 1024.0 * 1024.0;
constexpr double kLow_GiB = 1.0, kFull_GiB = 0.1;
constexpr double kEarliest_s = 1735689600;  ///< 2025-01-01; an earlier time was never set

bool InPath(const std::string& program) {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "/usr/bin:/bin");
  for (std::string file; std::getline(folders, file, ':');) {
    file.append("/").append(program);
    if (access(file.c_str(), X_OK) == 0) return true;
  }
  return false;
}

}  // namespace

CheckResult CheckClock() {
  const double now_s = service::SystemUtcSeconds();
  const std::string when = text::TextFromUtc(now_s);
  if (now_s < kEarliest_s) {
    return {Health::kFault, "clock", when + ": the clock was never set",
            "set it and enable time synchronisation: systemctl enable --now systemd-timesyncd"};
  }
  timex state{};
  if (adjtimex(&state) == TIME_ERROR || (state.status & STA_UNSYNC) != 0) {
    return {Health::kWarning, "clock", when + ", not synchronised",
            "effects of time need a correct clock: systemctl enable --now systemd-timesyncd (or "
            "chrony)"};
  }
  return {Health::kGood, "clock", when + ", synchronised", {}};
}

CheckResults CheckJournal(const std::string& state_directory) {
  const std::string file = state_directory + "/journal.sqlite";
  std::error_code unknown;
  if (!std::filesystem::exists(file, unknown)) return {};
  constexpr const char* kSubject = "journal";
  Result<cell::Journal> journal = cell::Journal::OpenForReading(file);
  if (!journal) {
    return {{Health::kFault, kSubject, journal.error(),
             "run `plumbline journal check` to see what is damaged"}};
  }
  const cell::IntegrityReport report = journal.value().Check();
  if (!report.intact()) {
    return {{Health::kFault, kSubject, fmt::format("{}: {}", file, DamageText(report)),
             "plumbline journal salvage, which saves the intact rows; or restore the backup"}};
  }
  return {{Health::kGood, kSubject, fmt::format("{} rows intact", report.rows), ""}};
}

CheckResult CheckStateDirectory(const std::string& directory, const Account& account) {
  const auto fault = [](const std::string& finding, const std::string& remedy) {
    return CheckResult{Health::kFault, "state directory", finding, remedy};
  };
  std::error_code unknown;
  if (!std::filesystem::is_directory(directory, unknown)) {
    return fault(directory + " does not exist",
                 "the service creates it at its first start; without the service, create it with "
                 "mkdir or set another state_directory");
  }
  if (const std::string why = AccessProblem(account, directory, true); !why.empty()) {
    return fault(why, fmt::format("chown -R {} {}", account.name,
                                  std::filesystem::absolute(directory).string()));
  }
  struct statvfs disk {};
  if (statvfs(directory.c_str(), &disk) != 0) {
    return fault(fmt::format("{}: {}", directory, std::strerror(errno)), "check the disk");
  }
  if ((disk.f_flag & ST_RDONLY) != 0) {
    return fault(directory + " is on a read-only file system",
                 "the kernel remounts a failing disk read-only: check dmesg; otherwise mount it "
                 "writable");
  }
  const double free_GiB =
      static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize) / kGiB;
  CheckResult found{Health::kGood,
                    "state directory",
                    fmt::format("{}, {:.1f} GiB free", directory, free_GiB),
                    {}};
  if (disk.f_favail == 0 && disk.f_files > 0)
    return fault(directory + ": the file system has no free inode", "delete files on it");
  if (free_GiB < kLow_GiB) {
    found.health = free_GiB < kFull_GiB ? Health::kFault : Health::kWarning;
    found.remedy = "free some space: probes are refused (code 19) when the disk is full";
  }
  return found;
}

CheckResult CheckSystemJournal(const std::string& persistent) {
  std::error_code unknown;
  if (std::filesystem::is_directory(persistent, unknown)) {
    return {Health::kGood, "system journal", "persistent, in " + persistent, {}};
  }
  return {Health::kWarning, "system journal",
          "not persistent: lost at every restart of the computer",
          fmt::format("mkdir {} && systemctl restart systemd-journald", persistent)};
}

CheckResults CheckPrograms(const config::DaemonConfig& config,
                           const std::string& program_directory) {
  CheckResults found;
  if (!config.overlay.objects_file.empty()) {
    const std::string reader = program_directory + "/plumbline-mesh";
    if (access(reader.c_str(), X_OK) == 0) {
      found.push_back({Health::kGood, "plumbline-mesh", reader, {}});
    } else {
      found.push_back({Health::kFault, "plumbline-mesh", reader + " is missing",
                       "reinstall the package: mesh files are read by this program"});
    }
  }
  if (config.monitoring.enabled && config.monitoring.diagnose) {
    if (InPath("gnuplot")) {
      found.push_back({Health::kGood, "gnuplot", "installed: reports have plots", {}});
    } else {
      found.push_back({Health::kWarning, "gnuplot",
                       "not installed: reports have tables but no plots",
                       "apt install gnuplot-nox"});
    }
  }
  return found;
}

namespace {

CheckResults FaultsOf(const config::FaultList& faults, const char* subject, const char* remedy) {
  CheckResults found;
  for (const config::Fault& fault : faults.All()) {
    found.push_back(
        {fault.severity == config::Fault::Severity::kFault ? Health::kFault : Health::kWarning,
         subject, config::FaultText(fault), remedy});
  }
  return found;
}

}  // namespace

CheckResults Examine(const std::string& config_file, const std::string& user) {
  const Account account = AccountByName(user);
  config::FaultList faults;
  const auto config = config::ReadDaemonConfig(config_file, faults);
  CheckResults found = FaultsOf(faults, "configuration", "fix that line");
  if (config) {
    const std::string problem = AccessProblem(account, config_file, false);
    const bool readable = problem.empty();
    found.insert(found.begin(), {readable ? Health::kGood : Health::kFault, "configuration",
                                 readable ? config_file : problem,
                                 readable ? ""
                                          : "chgrp " + account.name + " " + config_file +
                                                " && chmod 640 " + config_file});
  }
  const auto add = [&](const CheckResults& more) {
    found.insert(found.end(), more.begin(), more.end());
  };
  add({CheckClock(), CheckSystemJournal()});
  if (!config) return found;
  add({CheckStateDirectory(config->state_directory, account)});
  add(CheckJournal(config->state_directory));
  config::FaultList applied;
  cell::CheckModelStore(config->state_directory, config->cell_file, applied);
  add(FaultsOf(applied, "model in force",
               "plumbline model list, then plumbline model apply or rollback"));
  add(CheckPrograms(*config, files::ProgramFolder()));
  bool daemon_runs = false;
  add(CheckDaemon(*config, daemon_runs));
  add({CheckPlcAccess(config->plc.tcp)});
  for (const config::CameraConfig& camera : config->vision.cameras) {
    add({CheckCamera(camera, account), CheckZoomSensor(camera.zoom, account, daemon_runs)});
  }
  for (const config::GaugeConfig& gauge : config->gauges) add({CheckGauge(gauge, account)});
  add({CheckDisplay(config->overlay, account)});
  if (config->mqtt) add({CheckBroker(*config->mqtt, account)});
  return found;
}

}  // namespace plumbline::cli
