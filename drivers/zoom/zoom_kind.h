// Descriptor of a zoom sensor kind. Each kind defines one in its own source file.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "drivers/zoom/zoom.h"
#include "drivers/zoom/zoom_option.h"
#include "firmware-like/result.h"

namespace plumbline::zoom {

struct ZoomKind {
  std::string_view name;  ///< as in the configuration
  /// Creates a sensor. It is not connected yet; its first Read() connects.
  Result<std::unique_ptr<ZoomSensor>> (*make)(const ZoomConnection&) = nullptr;
  /// Identifies the physical sensor: equal identities are the same sensor. Empty for a recording.
  std::string (*identity)(const ZoomConnection&) = nullptr;
  /// Device file that will be opened, or why there is none; empty if it is not known in advance.
  Result<std::string> (*device)(const ZoomConnection&) = nullptr;
  /// Remedy if that file is missing or cannot be opened.
  const char* remedy = "";
  double period_s = kZoomPeriod_s;  ///< reading period, unless configured
  /// Keys of the table [zoom]. Kinds may share a key; it then has the same type and range.
  std::span<const ZoomOption> options = {};
};

}  // namespace plumbline::zoom
