// Embedded files of the page by their paths, with their content types.
#pragma once

#include <string>
#include <string_view>

namespace plumbline::display {

inline constexpr const char* kHtmlType = "text/html; charset=utf-8";

struct StaticFile {
  const char* path;
  std::string_view text;
  const char* type;
};

/// Null if the page has no such file.
const StaticFile* StaticFileAt(const std::string& path);

/// True for the files that the login page uses.
bool IsLoginFile(const std::string& path);

}  // namespace plumbline::display
