// Codec of the HID reports of dial gauges and their interfaces: reports to text. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

namespace plumbline::gauge {

/// Stands for what is no character of a gauge's text; part of no format.
inline constexpr char kSubstitute = '\x1A';

/// Text that a device types, from its keyboard reports.
///
/// Boot protocol [USB HID 1.11, appendix B.1]: modifiers, a reserved byte, then up to six keys that
/// are down [HID Usage Tables, page 7]; a report of nine bytes or more begins with a report id. A
/// key counts when it goes down. Enter and Tab end a line. The keys must be those of a US or German
/// layout, or of the numeric keypad; the comma is read as the decimal point. Every other key, and
/// one with Shift where the layouts differ, becomes kSubstitute, so that a reading with it is
/// unreadable instead of wrong.
class KeyReports {
 public:
  /// Appends the characters of the keys that this report adds.
  void Push(std::span<const std::uint8_t> report, std::string& text);
  void Clear() { down_ = {}; }

 private:
  static constexpr std::size_t kKeys = 6;
  std::array<std::uint8_t, kKeys> down_{};
};

/// Appends the text of a vendor-defined input report: ASCII, after at most two bytes that are no
/// characters (report id, length). A zero after the text ends the line, as CR and LF do; what
/// follows it is ignored. A report without text appends nothing.
void AppendReportText(std::span<const std::uint8_t> report, std::string& text);

}  // namespace plumbline::gauge
