#include "drivers/zoom/hid_codec.h"

#include <fmt/format.h>

#include <array>

namespace plumbline::zoom {
namespace {

/// @param report  must contain the field
std::int32_t ValueOf(const HidField& field, std::span<const std::uint8_t> report) {
  std::uint32_t value = 0;
  for (int i = 0; i < field.bytes; ++i) {
    const int place = field.at + (field.big_endian ? i : field.bytes - 1 - i);
    value = value << 8 | report[static_cast<std::size_t>(place)];
  }
  value &= field.mask;
  const int bits = 8 * field.bytes;
  if (field.is_signed && bits < 32 && (value >> (bits - 1) & 1) != 0) value |= ~0U << bits;
  return static_cast<std::int32_t>(value);
}

std::optional<std::string> FaultOf(const HidExchange& exchange) {
  if (exchange.answer_bytes < 1 || exchange.answer_bytes > kMaxHidReportBytes) {
    return fmt::format("an answer of {} bytes is outside 1..{}", exchange.answer_bytes,
                       kMaxHidReportBytes);
  }
  for (const auto& report : exchange.send) {
    if (report.empty() || report.size() > kMaxHidReportBytes) {
      return fmt::format("an output report of {} bytes is outside 1..{}", report.size(),
                         kMaxHidReportBytes);
    }
  }
  if (exchange.count_at &&
      (*exchange.count_at < 0 || *exchange.count_at >= exchange.answer_bytes)) {
    return "the count lies outside the answer";
  }
  if (exchange.fields.empty()) return "an exchange has no fields";
  for (const HidField& field : exchange.fields) {
    if (field.bytes != 1 && field.bytes != 2 && field.bytes != 4) {
      return fmt::format("a field of {} bytes is not 1, 2 or 4", field.bytes);
    }
    if (field.at < 0 || field.at + field.bytes > exchange.answer_bytes) {
      return fmt::format("a field at {} lies outside the answer of {} bytes", field.at,
                         exchange.answer_bytes);
    }
    if (field.mask == 0) return "the mask of a field is 0";
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> FaultOf(const HidProfile& profile) {
  std::array<int, 5> field_count{};
  if (profile.exchanges.empty()) return "no exchange";
  for (const HidExchange& exchange : profile.exchanges) {
    if (auto fault = FaultOf(exchange)) return fault;
    if (exchange.send.empty() && profile.exchanges.size() > 1) {
      return "a device that reports unsolicited must have exactly one exchange";
    }
    for (const HidField& field : exchange.fields) {
      if (++field_count[static_cast<std::size_t>(field.meaning)] > 1)
        return "a value is reported twice";
    }
  }
  const auto is_reported = [&field_count](HidField::Meaning meaning) {
    return field_count[static_cast<std::size_t>(meaning)] > 0;
  };
  if (!is_reported(HidField::Meaning::kZoomCounts) && !is_reported(HidField::Meaning::kMoving) &&
      !is_reported(HidField::Meaning::kMoved)) {
    return "neither the zoom position nor motion is reported";
  }
  return std::nullopt;
}

HidAnswer ReadingFromReport(const HidExchange& exchange, std::span<const std::uint8_t> report,
                            lens::ZoomReading& reading) {
  if (report.empty()) return HidAnswer::kShort;
  if (exchange.answer_id && report[0] != *exchange.answer_id) return HidAnswer::kOther;
  if (report.size() < static_cast<std::size_t>(exchange.answer_bytes)) return HidAnswer::kShort;
  if (exchange.count_at && report[static_cast<std::size_t>(*exchange.count_at)] < exchange.count) {
    return HidAnswer::kNotReady;
  }
  for (const HidField& field : exchange.fields) {
    const std::int32_t value = ValueOf(field, report);
    switch (field.meaning) {
      case HidField::Meaning::kZoomCounts:
        reading.zoom_counts = value;
        break;
      case HidField::Meaning::kFocusCounts:
        reading.focus_counts = value;
        break;
      case HidField::Meaning::kMoving:
        reading.motion = value != 0 ? lens::LensMotion::kMoving : lens::LensMotion::kSettled;
        break;
      case HidField::Meaning::kDigitalZoom:
        reading.digital_zoom = value != 0;
        break;
      case HidField::Meaning::kMoved:
        reading.moved = value != 0;
        break;
    }
  }
  return HidAnswer::kRead;
}

}  // namespace plumbline::zoom
