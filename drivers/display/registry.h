// Registry of display kinds. To add one, add a line to the table in registry.cc.
#pragma once

#include <memory>
#include <string_view>

#include "drivers/clock.h"
#include "drivers/display/display.h"
#include "drivers/display/framebuffer_display.h"
#include "drivers/display/kms_display.h"
#include "firmware-like/result.h"

namespace plumbline::display {

/// Settings of all kinds; each uses its own part.
struct DisplayConnection {
  KmsOptions kms = {};
  FramebufferOptions framebuffer = {};
  NoDisplayOptions none = {};
  Clock clock = MonotonicSeconds;
};

/// Creates a display of a kind: "kms", "framebuffer", "none". It is not connected yet; its first
/// Wait() connects.
Result<std::unique_ptr<Display>> MakeDisplay(std::string_view kind,
                                             const DisplayConnection& connection);

}  // namespace plumbline::display
