// Survey of the registers that an unknown device lets be read: unit id, tables, ranges, largest
// request. Gentle: one request at a time, with a pause, bounded in number and time.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/robot/decoding_search.h"
#include "drivers/robot/register_client.h"
#include "firmware-like/result.h"

namespace plumbline::robot {

struct SurveyOptions {
  std::optional<int> unit{};                  ///< the only one to be tried
  std::vector<std::pair<int, int>> ranges{};  ///< first and last; empty: the usual ones
  int joints = 6;                             ///< fewer adjacent registers are of no interest
  std::size_t max_words = 16384;              ///< of one table, after which its survey ends
  double max_s = 20;                          ///< after which the survey ends where it is
  /// Called with the share that is done and the present step. @return false to stop
  std::function<bool(double, const std::string&)> progress{};
};

struct DeviceMap {
  std::optional<int> unit{};            ///< that answers; nullopt: none
  std::vector<RegisterImage> images{};  ///< one per table with registers
  int max_count = kMaxRegistersOfRead;  ///< of one request
  std::vector<std::string> notes{};     ///< what was found on the way, with what to do about it
  bool complete = true;                 ///< false: stopped by time, number of requests or a person
};

/// Tries the units, then both register tables over the ranges.
DeviceMap Survey(RegisterClient& client, const SurveyOptions& options);

/// Reads, and once more after anything but words or an exception: one answer that is late or lost
/// is no refusal.
ReadOutcome ReadTwice(RegisterClient& client, int unit, const RegisterBlock& block);

/// Reads all registers of an image again. Fails with the reason if one of them is not given now.
Result<RegisterImage> ReadAgain(RegisterClient& client, const DeviceMap& map,
                                const RegisterImage& image);

/// "0-41, 128-255".
std::string RangesText(const RegisterImage& image);

/// Why a device does not give the blocks of a profile, and what to do; what is empty if it does.
struct LinkRemedyText {
  std::string what{}, remedy{};
};
LinkRemedyText ExamineLink(RegisterClient& client, int unit,
                           const std::vector<RegisterBlock>& blocks);

}  // namespace plumbline::robot
