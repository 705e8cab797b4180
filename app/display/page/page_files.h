// Files of the page (app/display/page/files), embedded into the program.
#pragma once

#include <string_view>

namespace plumbline::page_files {

extern const std::string_view kPage, kStyle, kScript, kPicturesScript, kTrendScript, kCamerasScript;
/// dygraphs, the chart library [dygraphs.com, MIT licence].
extern const std::string_view kChartScript;

}  // namespace plumbline::page_files
