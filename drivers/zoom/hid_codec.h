// HID reports of zoom lenses <-> values, by a profile. Pure.
//
// There is no standard usage for a zoom position: each make has reports of its own. A profile says
// which reports to send, and where the answer has what. It is read from config/profiles/zoom/*.toml
// (app/config/zoom_profile_reader.h), which documents each key.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware-like/lens/zoom_reading.h"

namespace plumbline {

inline constexpr int kMostReportBytes = 64;  ///< of full-speed USB, with the report's number

/// One value in a report: up to four bytes, masked.
struct HidField {
  enum class Meaning : std::uint8_t { kZoomCounts, kFocusCounts, kMoving, kDigitalZoom, kMoved };
  Meaning meaning = Meaning::kZoomCounts;
  int at = 0;     ///< of its first byte; the report's number, where it has one, is byte 0
  int bytes = 2;  ///< 1, 2 or 4
  bool big_endian = true;
  bool is_signed = false;
  std::uint32_t mask = 0xFFFFFFFF;  ///< a flag is set where anything is left under the mask
};

/// Reports to send, one after the other, and the report that answers them.
struct HidExchange {
  std::vector<std::vector<std::uint8_t>> send;  ///< none: the device speaks unasked
  std::optional<std::uint8_t> answer_id;  ///< byte 0 of the answer; none: reports are not numbered
  int answer_bytes = 0;                   ///< a shorter answer is refused
  std::optional<int>
      count_at;   ///< byte that tells how much data is valid: fewer than `count` means
  int count = 0;  ///< not ready yet
  std::vector<HidField> fields;
};

struct HidProfile {
  std::string name;
  std::string source;
  std::string unconfirmed;  ///< what its source leaves open; empty: nothing
  int vendor_id = 0, product_id = 0;
  bool silence_is_unchanged = false;  ///< a device that speaks unasked says only changes
  std::vector<HidExchange> exchanges;
};

/// What makes a profile unusable, in words; nothing where it is sound: an exchange without fields,
/// a field outside of the answer, a value told twice, no zoom position and no motion.
std::optional<std::string> FaultOf(const HidProfile& profile);

enum class HidAnswer : std::uint8_t {
  kRead,
  kOther,     ///< another report
  kShort,     ///< the right one, but too short
  kNotReady,  ///< it says that it holds nothing yet
};

/// Puts what the report tells into `reading`, which is changed only where kRead is answered.
/// @param exchange  of a sound profile
HidAnswer ReadingFromReport(const HidExchange& exchange, std::span<const std::uint8_t> report,
                            ZoomReading& reading);

}  // namespace plumbline
