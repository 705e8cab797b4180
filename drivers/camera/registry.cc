#include "drivers/camera/registry.h"

#include "drivers/device_kinds.h"

namespace plumbline::camera {
namespace {

constexpr DeviceKind<Camera, CameraConnection> kKinds[] = {
    {"v4l2", [](const CameraConnection& c) { return V4l2Camera::Create(c.v4l2, c.clock); }},
    {"recorded",
     [](const CameraConnection& c) { return RecordedCamera::Create(c.recorded, c.clock); }},
    {"dv", [](const CameraConnection& c) { return DvStreamCamera::Create(c.dv, c.clock); }},
};

}  // namespace

Result<std::unique_ptr<Camera>> MakeCamera(std::string_view kind,
                                           const CameraConnection& connection) {
  return MakeOfKind(kKinds, "camera", kind, connection);
}

}  // namespace plumbline::camera
