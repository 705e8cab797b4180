// The kinds of zoom sensor there are. A new kind is one line in the table of registry.cc.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "drivers/zoom/gpio_zoom.h"
#include "drivers/zoom/hid_zoom.h"
#include "drivers/zoom/replay_zoom.h"
#include "drivers/zoom/v4l2_zoom.h"
#include "drivers/zoom/visca_zoom.h"

namespace plumbline {

/// All that any kind may need; each takes its own.
struct ZoomConnection {
  ViscaOptions visca;
  HidOptions hid;
  V4l2ZoomOptions v4l2;
  GpioOptions gpio;
  std::vector<ZoomRow> replay;
  Clock clock = MonotonicSeconds;
};

/// In the order of the table.
std::span<const ZoomKind* const> ZoomKinds();

/// Null where there is none of that name.
const ZoomKind* FindZoomKind(std::string_view name);

}  // namespace plumbline
