#include "app/display/page/static_files.h"

#include <algorithm>
#include <array>

#include "app/display/page/page_files.h"

namespace plumbline::display {

const StaticFile* StaticFileAt(const std::string& path) {
  static const std::array kFiles = {
      StaticFile{"/", page_files::kPage, kHtmlType},
      StaticFile{"/page.js", page_files::kScript, "text/javascript; charset=utf-8"},
      StaticFile{"/trend.js", page_files::kTrendScript, "text/javascript; charset=utf-8"},
      StaticFile{"/pictures.js", page_files::kPicturesScript, "text/javascript; charset=utf-8"},
      StaticFile{"/cameras.js", page_files::kCamerasScript, "text/javascript; charset=utf-8"},
      StaticFile{"/chart.js", page_files::kChartScript, "text/javascript; charset=utf-8"},
      StaticFile{"/page.css", page_files::kStyle, "text/css; charset=utf-8"},
      StaticFile{"/login.js", page_files::kLoginScript, "text/javascript; charset=utf-8"},
      StaticFile{"/icon.svg", page_files::kIcon, "image/svg+xml"},
  };
  const auto* const found = std::find_if(kFiles.begin(), kFiles.end(),
                                         [&](const StaticFile& f) { return path == f.path; });
  return found == kFiles.end() ? nullptr : found;
}

bool IsLoginFile(const std::string& path) {
  return path == "/page.css" || path == "/login.js" || path == "/icon.svg";
}

}  // namespace plumbline::display
