// Files of the plant's page (app/plant/page/files), embedded into the program.
#pragma once

#include <string_view>

namespace plumbline::plant_page_files {

extern const std::string_view kScript, kStyle;

}  // namespace plumbline::plant_page_files
