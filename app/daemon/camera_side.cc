#include "app/daemon/camera_side.h"

#include "app/daemon/diagnosis_process.h"
#include "app/log/log.h"

namespace plumbline {

Result<std::unique_ptr<CameraWatch>> CameraWatchFor(const DaemonConfig& config, CameraLink& link,
                                                    ViewSide& view) {
  if (!config.camera) return std::unique_ptr<CameraWatch>();
  auto devices = CameraDevicesFrom(*config.camera);
  if (!devices) return Error{devices.error()};
  return std::make_unique<CameraWatch>(
      *config.camera, std::move(devices).value(),
      CameraWatch::Places{config.state_directory, PlumblineProgram()}, link, Log,
      [&view](Camera& camera, const CameraFrame& frame, const TrackedFrame& seen,
              const Lens* lens) { view.TakeImage(camera, frame, seen, lens); });
}

bool CameraDiffers(const DaemonConfig& a, const DaemonConfig& b) {
  const auto text = [](const DaemonConfig& config) {
    return config.camera ? config.camera->text : std::string();
  };
  return text(a) != text(b);
}

}  // namespace plumbline
