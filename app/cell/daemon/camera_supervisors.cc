#include "app/cell/daemon/camera_supervisors.h"

#include <fmt/format.h>

#include "app/base/log/log.h"
#include "app/cell/daemon/device_wait.h"
#include "drivers/files/package_paths.h"

namespace plumbline::cell {
namespace {

/// The sensor thread may wait for a serial line; the image thread may be solving for a lens.
constexpr double kSensorTimeout_s = 5, kImageTimeout_s = 5;

void AddThread(ThreadWatchdog& watchdog, const std::string& thread, double timeout_s,
               const ThreadHeartbeat& heartbeat) {
  watchdog.Add(
      thread, timeout_s, [&heartbeat] { return heartbeat.beats(); },
      [&heartbeat] { return IsWaitingForDevice(heartbeat.thread()); });
}

log::LogSink CameraSink(const std::string& name) {
  return [name](log::LogEntry entry) {
    entry.text = CameraLogLine(name, entry.text);
    if (!name.empty()) entry.fields.insert(entry.fields.begin(), {"CAMERA", name});
    Log(entry);
  };
}

}  // namespace

std::string CameraLogLine(const std::string& name, const std::string& text) {
  constexpr std::string_view kSubject = "camera";
  if (name.empty()) return text;
  if (!text.starts_with(kSubject)) return fmt::format("camera {}: {}", name, text);
  return fmt::format("camera {}{}", name, text.substr(kSubject.size()));
}

CameraSupervisors::CameraSupervisors(const config::DaemonConfig& config)
    : stores_(config.state_directory, config::CellReferenceTags(config.vision.tags),
              CameraSink("")) {}

Result<std::unique_ptr<CameraSupervisors>> CameraSupervisors::Open(
    const config::DaemonConfig& config, CycleMailboxes& mailboxes, DisplayFeed& display) {
  std::unique_ptr<CameraSupervisors> supervisors(new CameraSupervisors(config));
  const config::VisionConfig& vision = config.vision;
  for (std::size_t k = 0; k < vision.cameras.size(); ++k) {
    const config::CameraConfig& camera = vision.cameras[k];
    const std::string name = status::CameraNameText(camera.name);
    auto devices = vision::MakeCameraDevices(camera, vision.tags);
    if (!devices) return Error{CameraLogLine(name, devices.error())};
    const auto show = [&display, k](camera::Camera& shown, const camera::CameraFrame& frame,
                                    const vision::TrackedFrame& seen, const lens::KnownLens* lens,
                                    const lens::BoardGuidance* guidance) {
      display.PublishImage(k, shown, frame, seen, lens, guidance);
    };
    supervisors->cameras_.push_back(
        {name, std::make_unique<vision::CameraSupervisor>(
                   camera, vision, std::move(devices).value(), supervisors->stores_,
                   files::PlumblineProgram(), mailboxes.cameras[k], CameraSink(name), show)});
  }
  return supervisors;
}

void CameraSupervisors::Start() {
  for (const Supervised& camera : cameras_) camera.supervisor->Start();
}

void CameraSupervisors::Stop() {
  for (const Supervised& camera : cameras_) camera.supervisor->Stop();
}

void CameraSupervisors::AddTo(ThreadWatchdog& watchdog) const {
  for (const Supervised& camera : cameras_) {
    AddThread(watchdog, CameraLogLine(camera.name, "zoom sensor"), kSensorTimeout_s,
              camera.supervisor->sensor_heartbeat());
    AddThread(watchdog, CameraLogLine(camera.name, "camera images"), kImageTimeout_s,
              camera.supervisor->image_heartbeat());
  }
}

bool CamerasDiffer(const config::DaemonConfig& a, const config::DaemonConfig& b) {
  return a.vision.text != b.vision.text;
}

}  // namespace plumbline::cell
