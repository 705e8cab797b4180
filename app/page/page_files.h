// The files of the page, which are part of the program (app/page/files).
#pragma once

#include <string_view>

namespace plumbline::page_files {

extern const std::string_view kPage, kStyle, kScript, kTrendScript, kLogin, kLoginScript, kIcon;

}  // namespace plumbline::page_files
