// The kinds of zoom sensor there are. A new kind is one line in the table of registry.cc.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "drivers/zoom/gpio_zoom.h"
#include "drivers/zoom/hid_zoom.h"
#include "drivers/zoom/replay_zoom.h"
#include "drivers/zoom/v4l2_zoom.h"
#include "drivers/zoom/visca_zoom.h"
#include "drivers/zoom/zoom.h"
#include "firmware-like/result.h"

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

/// "visca", "hid", "v4l2", "gpio", "replay".
std::vector<std::string_view> ZoomKinds();

/// A sensor that is not connected yet; its first Read() connects.
Result<std::unique_ptr<ZoomSensor>> MakeZoomSensor(std::string_view kind,
                                                   const ZoomConnection& connection);

}  // namespace plumbline
