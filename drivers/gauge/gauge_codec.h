// Codec of the text that dial gauges send. Pure.
//
// A gauge sends one line per reading when its data button is pressed. The formats are those of the
// vendors' manuals; what a format does not send, such as the unit, is null.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "drivers/os/serial_line.h"

namespace plumbline::gauge {

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
