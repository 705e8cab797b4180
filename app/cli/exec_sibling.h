// Delegation of commands to other programs of the package, which link what this one does not.
#pragma once

#include <string>
#include <vector>

namespace plumbline::cli {

/// Replaces this process with a program that is installed beside it. Returns only on failure, after
/// printing the reason.
/// @param program  its file name
/// @param command  the command of plumbline, for the error message
/// @return         the exit code
int ExecSibling(const std::string& program, const std::string& command,
                std::vector<std::string> arguments);

/// plumbline-view draws and measures the overlay's scene.
inline int ExecView(const std::string& command, std::vector<std::string> arguments) {
  return ExecSibling("plumbline-view", command, std::move(arguments));
}

}  // namespace plumbline::cli
