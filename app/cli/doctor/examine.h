// All checks of an installation, in the order in which problems should be fixed.
#pragma once

#include <string>

#include "app/cli/doctor/check_result.h"

namespace plumbline::cli {

/// @param user  account of the service, whose permissions are checked; the calling user's if there
///              is no account of that name
CheckResults Examine(const std::string& config_file, const std::string& user);

}  // namespace plumbline::cli
