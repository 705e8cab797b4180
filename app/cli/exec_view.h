// Delegation of the commands that draw or measure the overlay's scene to plumbline-view.
#pragma once

#include <string>
#include <vector>

namespace plumbline::cli {

/// Replaces this process with plumbline-view, which is installed beside this program and is the
/// only one linked with the drawing and measuring libraries. Returns only on failure, after
/// printing the reason.
/// @param command  the command of plumbline, for the error message
/// @return         the exit code
int ExecView(const std::string& command, std::vector<std::string> arguments);

}  // namespace plumbline::cli
