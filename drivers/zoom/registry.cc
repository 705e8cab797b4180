#include "drivers/zoom/registry.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>

namespace plumbline {
namespace {

using Sensor = Result<std::unique_ptr<ZoomSensor>>;

struct Kind {
  std::string_view name;
  Sensor (*make)(const ZoomConnection&);
};

constexpr std::array<Kind, 5> kKinds = {{
    {"visca", [](const ZoomConnection& c) { return ViscaZoom::Create(c.visca, c.clock); }},
    {"hid", [](const ZoomConnection& c) { return HidZoom::Create(c.hid, c.clock); }},
    {"v4l2", [](const ZoomConnection& c) { return V4l2Zoom::Create(c.v4l2, c.clock); }},
    {"gpio", [](const ZoomConnection& c) { return GpioZoom::Create(c.gpio, c.clock); }},
    {"replay", [](const ZoomConnection& c) { return ReplayZoom::Create(c.replay, c.clock); }},
}};

}  // namespace

std::vector<std::string_view> ZoomKinds() {
  std::vector<std::string_view> names;
  names.reserve(kKinds.size());
  for (const Kind& kind : kKinds) names.push_back(kind.name);
  return names;
}

Result<std::unique_ptr<ZoomSensor>> MakeZoomSensor(std::string_view kind,
                                                   const ZoomConnection& connection) {
  for (const Kind& known : kKinds) {
    if (known.name == kind) return known.make(connection);
  }
  return Error{
      fmt::format("zoom sensor \"{}\" is not one of {}", kind, fmt::join(ZoomKinds(), ", "))};
}

}  // namespace plumbline
