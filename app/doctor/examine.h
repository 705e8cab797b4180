// The whole examination, in the order in which one would mend.
#pragma once

#include <string>

#include "app/doctor/check_up.h"

namespace plumbline {

/// @param user  the service's, whose rights count; of a name that is not there, one's own
CheckUp Examine(const std::string& config_file, const std::string& user);

}  // namespace plumbline
