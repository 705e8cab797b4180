#include "drivers/zoom/registry.h"

#include <algorithm>
#include <array>

namespace plumbline::zoom {
namespace {

constexpr std::array<const ZoomKind*, 5> kKinds = {
    &kViscaKind, &kHidKind, &kV4l2ZoomKind, &kGpioKind, &kReplayZoomKind,
};

}  // namespace

std::span<const ZoomKind* const> ZoomKinds() {
  return kKinds;
}

const ZoomKind* FindZoomKind(std::string_view name) {
  const auto* const found = std::find_if(
      kKinds.begin(), kKinds.end(), [name](const ZoomKind* kind) { return kind->name == name; });
  return found == kKinds.end() ? nullptr : *found;
}

}  // namespace plumbline::zoom
