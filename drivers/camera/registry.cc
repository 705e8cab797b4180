#include "drivers/camera/registry.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>

namespace plumbline::camera {
namespace {

using Device = Result<std::unique_ptr<Camera>>;

struct Kind {
  std::string_view name;
  Device (*make)(const CameraConnection&);
};

constexpr std::array<Kind, 3> kKinds = {{
    {"v4l2", [](const CameraConnection& c) { return V4l2Camera::Create(c.v4l2, c.clock); }},
    {"recorded",
     [](const CameraConnection& c) { return RecordedCamera::Create(c.recorded, c.clock); }},
    {"dv", [](const CameraConnection& c) { return DvStreamCamera::Create(c.dv, c.clock); }},
}};

}  // namespace

std::vector<std::string_view> CameraKinds() {
  std::vector<std::string_view> names;
  names.reserve(kKinds.size());
  for (const Kind& kind : kKinds) names.push_back(kind.name);
  return names;
}

Result<std::unique_ptr<Camera>> MakeCamera(std::string_view kind,
                                           const CameraConnection& connection) {
  for (const Kind& known : kKinds) {
    if (known.name == kind) return known.make(connection);
  }
  return Error{fmt::format("camera \"{}\" is not one of {}", kind, fmt::join(CameraKinds(), ", "))};
}

}  // namespace plumbline::camera
