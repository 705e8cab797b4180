// Files that contain a password or token, and who may read them.
#pragma once

#include <optional>
#include <string>

namespace plumbline::config {

/// "is readable by every user of this computer; restrict it: ..."; nullopt if it is not, or does
/// not exist.
std::optional<std::string> WhyExposed(const std::string& file);

}  // namespace plumbline::config
