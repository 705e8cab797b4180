// Codec of the text that dial gauges send. Pure.
//
// A gauge sends one line per reading when its data button is pressed. The formats are those of the
// vendors' manuals; what a format does not send, such as the unit, is null.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "drivers/os/serial_line.h"

namespace plumbline::gauge {

// Codec of the HID reports of dial gauges and their interfaces: reports to text. Pure.

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

inline constexpr std::size_t kMaxLineBytes = 64;  ///< the longest line of any format has 24

enum class GaugeUnit : std::uint8_t { kMillimetre, kInch };

/// Factor from the unit to metres.
double MetresPer(GaugeUnit unit);

/// Meaning of one line.
struct GaugeLine {
  enum class Kind : std::uint8_t {
    kReading,
    kFault,  ///< the gauge reports a fault of its own
    kOther,  ///< not of this format
  };
  Kind kind = Kind::kOther;
  double value = 0;               ///< in `unit`, or in the unit that the gauge is set to
  std::optional<GaugeUnit> unit;  ///< if the line states it
  std::string_view fault;         ///< what the gauge reports, and the remedy
};

/// A vendor's format. To add one, write its parser and a line of the table in gauge_codec.cc.
struct GaugeFormat {
  std::string_view name;    ///< as in the configuration
  std::string_view what;    ///< the gauges that use it
  os::SerialSettings line;  ///< as the manual states it
  GaugeLine (*parse)(std::string_view line) = nullptr;
};

std::span<const GaugeFormat> GaugeFormats();
/// @return  nullptr if there is no such format
const GaugeFormat* FindGaugeFormat(std::string_view name);

/// Splits received bytes into lines at CR, LF or both.
class LineReceiver {
 public:
  /// @return  the line that this byte ends, without blanks around it; nullopt if it ends none, or
  ///          an empty one. Valid until the next call. A line of kMaxLineBytes or more ends with a
  ///          character that no format accepts.
  std::optional<std::string_view> Push(char byte);
  void Clear() { pending_.clear(); }
  bool empty() const { return pending_.empty(); }
  /// Received after the end of the latest line.
  std::string_view pending() const { return pending_; }
  /// True if pending() is longer than a line of any format.
  bool overlong() const { return pending_.size() >= kMaxLineBytes; }

 private:
  std::string pending_, line_;
};

}  // namespace plumbline::gauge
