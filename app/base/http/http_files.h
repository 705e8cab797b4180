// Files that the sites of this product share (app/base/http/files), embedded into the program.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "app/base/http/http_message.h"

namespace plumbline::http {

inline constexpr const char* kHtmlType = "text/html; charset=utf-8";
inline constexpr const char* kScriptType = "text/javascript; charset=utf-8";
inline constexpr const char* kStyleType = "text/css; charset=utf-8";
inline constexpr const char* kIconType = "image/svg+xml";

namespace files {
extern const std::string_view kLogin, kLoginScript, kIcon;
}

/// Embedded file by its path.
struct StaticFile {
  const char* path;
  std::string_view text;
  const char* type;
};

/// Answers with the file of the request's path. @return  false if there is none
bool AnswerFile(std::span<const StaticFile> files, const std::string& path, HttpResponse& response);

}  // namespace plumbline::http
