// The kinds of display there are. A new kind is one line in the table of registry.cc.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "drivers/clock.h"
#include "drivers/display/display.h"
#include "drivers/display/framebuffer_display.h"
#include "drivers/display/kms_display.h"
#include "drivers/display/no_display.h"
#include "firmware-like/result.h"

namespace plumbline {

/// All that any kind may need; each takes its own.
struct DisplayConnection {
  KmsOptions kms = {};
  FramebufferOptions framebuffer = {};
  NoDisplayOptions none = {};
  Clock clock = MonotonicSeconds;
};

/// "kms", "framebuffer", "none".
std::vector<std::string_view> DisplayKinds();

/// A display that is not connected yet; its first Wait() connects.
Result<std::unique_ptr<Display>> MakeDisplay(std::string_view kind,
                                             const DisplayConnection& connection);

}  // namespace plumbline
