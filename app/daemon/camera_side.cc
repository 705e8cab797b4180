#include "app/daemon/camera_side.h"

#include <fmt/format.h>

#include "app/daemon/device_wait.h"
#include "app/daemon/diagnosis_process.h"
#include "app/log/log.h"

namespace plumbline {
namespace {

/// The sensor's thread may wait for a serial line, the images' solves a lens.
constexpr double kSensorPatience_s = 5, kImagePatience_s = 5;

void AddPulse(Lifeline& lifeline, const std::string& thread, double patience_s,
              const Pulse& pulse) {
  lifeline.Add(
      thread, patience_s, [&pulse] { return pulse.beats(); },
      [&pulse] { return WaitsForDevice(pulse.thread()); });
}

LogSink SinkOf(const std::string& name) {
  return [name](LogEntry entry) {
    entry.text = LineOfCamera(name, entry.text);
    if (!name.empty()) entry.fields.insert(entry.fields.begin(), {"CAMERA", name});
    Log(entry);
  };
}

}  // namespace

std::string LineOfCamera(const std::string& name, const std::string& text) {
  constexpr std::string_view kSubject = "camera";
  if (name.empty()) return text;
  if (!text.starts_with(kSubject)) return fmt::format("camera {}: {}", name, text);
  return fmt::format("camera {}{}", name, text.substr(kSubject.size()));
}

CameraSide::CameraSide(const DaemonConfig& config)
    : stores_(config.state_directory, CellMarksOf(config.vision.tags), SinkOf("")) {}

Result<std::unique_ptr<CameraSide>> CameraSide::Open(const DaemonConfig& config, LoopLink& link,
                                                     ViewSide& view) {
  std::unique_ptr<CameraSide> side(new CameraSide(config));
  const VisionConfig& vision = config.vision;
  for (std::size_t k = 0; k < vision.cameras.size(); ++k) {
    const CameraConfig& camera = vision.cameras[k];
    const std::string name = CameraNameText(camera.name);
    auto devices = CameraDevicesFrom(camera, vision.tags);
    if (!devices) return Error{LineOfCamera(name, devices.error())};
    const auto show = [&view, k](Camera& shown, const CameraFrame& frame, const TrackedFrame& seen,
                                 const Lens* lens) { view.TakeImage(k, shown, frame, seen, lens); };
    side->cameras_.push_back({name, std::make_unique<CameraWatch>(
                                        camera, vision, std::move(devices).value(), side->stores_,
                                        PlumblineProgram(), link.cameras[k], SinkOf(name), show)});
  }
  return side;
}

void CameraSide::Start() {
  for (const Watched& camera : cameras_) camera.watch->Start();
}

void CameraSide::Stop() {
  for (const Watched& camera : cameras_) camera.watch->Stop();
}

void CameraSide::AddTo(Lifeline& lifeline) const {
  for (const Watched& camera : cameras_) {
    AddPulse(lifeline, LineOfCamera(camera.name, "zoom sensor"), kSensorPatience_s,
             camera.watch->sensor_pulse());
    AddPulse(lifeline, LineOfCamera(camera.name, "camera images"), kImagePatience_s,
             camera.watch->image_pulse());
  }
}

bool CameraDiffers(const DaemonConfig& a, const DaemonConfig& b) {
  return a.vision.text != b.vision.text;
}

}  // namespace plumbline
