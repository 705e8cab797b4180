// Registry of zoom sensor kinds. To add one, add a line to the table in registry.cc.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "drivers/zoom/gpio_zoom.h"
#include "drivers/zoom/hid_zoom.h"
#include "drivers/zoom/replay_zoom.h"
#include "drivers/zoom/v4l2_zoom.h"
#include "drivers/zoom/visca_zoom.h"

namespace plumbline::zoom {

/// Settings of all kinds; each uses its own part.
struct ZoomConnection {
  ViscaOptions visca;
  HidOptions hid;
  V4l2ZoomOptions v4l2;
  GpioOptions gpio;
  std::vector<ZoomRow> replay;
  Clock clock = MonotonicSeconds;
};

/// All kinds, in table order.
std::span<const ZoomKind* const> ZoomKinds();

/// Finds a kind by name; nullptr if there is none.
const ZoomKind* FindZoomKind(std::string_view name);

}  // namespace plumbline::zoom
