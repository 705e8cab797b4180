// Commands that draw or measure what the monitor shows are carried out by plumbline-view.
#pragma once

#include <string>
#include <vector>

namespace plumbline {

/// Becomes plumbline-view, which lies beside this program: it alone is linked with what draws and
/// measures. Returns only where that cannot be, having said so.
/// @param command  of plumbline, for what it says
/// @return         the process's exit code
int BecomeView(const std::string& command, std::vector<std::string> arguments);

}  // namespace plumbline
