// What a kind of zoom sensor tells of itself. Each kind defines one of these in its own files.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "drivers/zoom/zoom.h"
#include "firmware-like/result.h"

namespace plumbline {

struct ZoomConnection;

struct ZoomKind {
  std::string_view name;  ///< as the configuration has it
  /// A sensor that is not connected yet; its first Read() connects.
  Result<std::unique_ptr<ZoomSensor>> (*make)(const ZoomConnection&) = nullptr;
  /// What one sensor alone can be: two of one identity are the same. Empty of a recording.
  std::string (*identity)(const ZoomConnection&) = nullptr;
  /// The device file that will be opened, or why there is none; empty where it cannot be known
  /// before.
  Result<std::string> (*device)(const ZoomConnection&) = nullptr;
  /// What to do where that file is not there, or may not be opened.
  const char* remedy = "";
  double period_s = kZoomPeriod_s;  ///< from reading to reading, unless configured
};

}  // namespace plumbline
