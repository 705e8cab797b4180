// Text of a robot profile for a decoding that a scan has found.
#pragma once

#include <string>
#include <vector>

#include "drivers/robot/register_survey.h"

namespace plumbline::cli {

/// A decided decoding of one device.
struct FoundProfile {
  std::string name, host, evidence;
  int port = 502, unit = 1;
  robot::DecodingCandidate candidate{};
  std::vector<robot::RegisterBlock> blocks{};
};

/// Blocks of at most `max_count` registers for everything that the candidate reads.
std::vector<robot::RegisterBlock> BlocksOf(const robot::DecodingCandidate& candidate,
                                           const robot::RegisterImage& image, int max_count);

/// @param prismatic  one per joint: counts a length
std::string ProfileText(const FoundProfile& found, const std::vector<bool>& prismatic);

}  // namespace plumbline::cli
