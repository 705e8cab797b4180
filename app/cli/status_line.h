// Line of `plumbline status`: a topic in the first column, then text.
#pragma once

#include <ostream>
#include <span>
#include <string>
#include <string_view>

#include "drivers/plc/register_map.h"

namespace plumbline::cli {

/// Prints "topic        text". An empty topic continues the topic of the line above.
void PrintStatusLine(std::ostream& out, std::string_view topic, std::string_view text);

/// "none", or "0x0041: nothing read from the robot, a point has no correction".
std::string BitsText(int word, std::span<const plc::BitMeaning> bits);

}  // namespace plumbline::cli
