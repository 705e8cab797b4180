// Recognition of a file that another process or library reads, by its first bytes.
#pragma once

#include <optional>
#include <string>

#include "app/base/config/wrong_file.h"

namespace plumbline::cli {

/// Why a file is certainly not what is wanted; see config::RefuseWrongFile(). The name is left out.
/// @return  nullopt if it may be, or cannot be read
std::optional<std::string> WrongFileText(const std::string& path, const config::Wanted& wanted);

}  // namespace plumbline::cli
