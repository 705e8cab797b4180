// Files of the page (app/page/files), embedded into the program.
#pragma once

#include <string_view>

namespace plumbline::page_files {

extern const std::string_view kPage, kStyle, kScript, kTrendScript, kLogin, kLoginScript, kIcon;

}  // namespace plumbline::page_files
