// Names of log levels: "error", "warning", "notice", "info".
#pragma once

#include <optional>
#include <string_view>

#include "app/base/log/event.h"

namespace plumbline::log {

inline const char* LevelText(LogLevel level) {
  switch (level) {
    case LogLevel::kError:
      return "error";
    case LogLevel::kWarning:
      return "warning";
    case LogLevel::kNotice:
      return "notice";
    case LogLevel::kInfo:
      break;
  }
  return "info";
}

/// nullopt if `text` is not the name of a level.
inline std::optional<LogLevel> LevelFromText(std::string_view text) {
  for (const LogLevel level :
       {LogLevel::kError, LogLevel::kWarning, LogLevel::kNotice, LogLevel::kInfo}) {
    if (text == LevelText(level)) return level;
  }
  return {};
}

}  // namespace plumbline::log
