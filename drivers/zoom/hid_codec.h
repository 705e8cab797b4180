// Codec for HID reports of zoom lenses, driven by a profile. Pure.
//
// There is no standard HID usage for a zoom position: every vendor has its own reports. A profile
// defines the reports to send and the layout of the answers. It is read from
// config/profiles/zoom/*.toml by app/base/config/zoom_profile_reader.h, which documents each key.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/hid/hid_name.h"
#include "firmware-like/lens/zoom_reading.h"

namespace plumbline::zoom {

inline constexpr int kMaxHidReportBytes = hid::kMaxReportBytes;

/// One value in a report: up to four bytes under a mask.
struct HidField {
  enum class Meaning : std::uint8_t { kZoomCounts, kFocusCounts, kMoving, kDigitalZoom, kMoved };
  Meaning meaning = Meaning::kZoomCounts;
  int at = 0;     ///< offset of the first byte; the report id, if any, is byte 0
  int bytes = 2;  ///< 1, 2 or 4
  bool big_endian = true;
  bool is_signed = false;
  std::uint32_t mask = 0xFFFFFFFF;  ///< a flag is set if any bit under the mask is set
};

/// Request reports, sent in this order, and the report that is expected as the answer.
struct HidExchange {
  std::vector<std::vector<std::uint8_t>> send;  ///< empty if the device reports unsolicited
  std::optional<std::uint8_t> answer_id;        ///< byte 0 of the answer; nullopt without ids
  int answer_bytes = 0;                         ///< a shorter answer is rejected
  std::optional<int> count_at;                  ///< byte that holds the amount of valid data
  int count = 0;                                ///< smaller values at count_at mean "not ready yet"
  std::vector<HidField> fields;
};

struct HidProfile {
  std::string name;
  std::string source;
  std::string unconfirmed;  ///< what the source does not specify; empty if nothing
  int vendor_id = 0, product_id = 0;
  bool silence_is_unchanged = false;  ///< unsolicited device that reports only changes
  std::vector<HidExchange> exchanges;
};

/// Fault of a profile, or nullopt if it is usable: an exchange without fields, a field outside the
/// answer, a value reported twice, or neither zoom position nor motion.
std::optional<std::string> FaultOf(const HidProfile& profile);

enum class HidAnswer : std::uint8_t {
  kRead,
  kOther,     ///< another report
  kShort,     ///< the expected report, but too short
  kNotReady,  ///< it holds no data yet
};

/// Decodes a report into `reading`, which is changed only if kRead is returned.
/// @param exchange  of a profile without fault
HidAnswer ReadingFromReport(const HidExchange& exchange, std::span<const std::uint8_t> report,
                            lens::ZoomReading& reading);

}  // namespace plumbline::zoom
