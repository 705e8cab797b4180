#include "drivers/gauge/gauge_codec.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

namespace plumbline::gauge {
namespace {

constexpr std::size_t kBootReportBytes = 8;
constexpr std::uint8_t kShift = 0x22;      // left and right
constexpr std::uint8_t kOtherMods = 0xDD;  // Ctrl, Alt, GUI

struct Key {
  std::uint8_t usage;
  char plain, shifted;
};

// Usages of page 7. Letters are handled apart.
constexpr Key kKeysOfText[] = {
    {0x2C, ' ', ' '},                                    // space
    {0x28, '\r', '\r'},                                  // Enter
    {0x58, '\r', '\r'},                                  // keypad Enter
    {0x2B, '\r', '\r'},                                  // Tab
    {0x2D, '-', kSubstitute}, {0x38, '-', kSubstitute},  // German layout
    {0x56, '-', '-'},                                    // keypad
    {0x2E, kSubstitute, '+'},                            // = and + of the US layout
    {0x30, '+', kSubstitute},                            // German layout
    {0x57, '+', '+'},                                    // keypad
    {0x37, '.', kSubstitute}, {0x36, '.', kSubstitute},  // comma
    {0x63, '.', '.'},                                    // keypad
};

bool IsBetween(std::uint8_t usage, int first, int last) {
  return usage >= first && usage <= last;
}

char CharacterOf(std::uint8_t usage, std::uint8_t modifiers) {
  if ((modifiers & kOtherMods) != 0) return kSubstitute;
  const bool shift = (modifiers & kShift) != 0;
  if (IsBetween(usage, 0x04, 0x1D)) {
    return static_cast<char>((shift ? 'A' : 'a') + (usage - 0x04));
  }
  const bool row = IsBetween(usage, 0x1E, 0x27), keypad = IsBetween(usage, 0x59, 0x62);
  if (row || keypad) {  // 1 to 9, then 0
    if (row && shift) return kSubstitute;
    return static_cast<char>('0' + (usage - (row ? 0x1E : 0x59) + 1) % 10);
  }
  for (const Key& key : kKeysOfText) {
    if (key.usage == usage) return shift ? key.shifted : key.plain;
  }
  return kSubstitute;
}

bool IsEnd(std::uint8_t byte) {
  return byte == '\r' || byte == '\n';
}

bool IsText(std::uint8_t byte) {
  return byte >= ' ' && byte <= '~';
}

}  // namespace

void KeyReports::Push(std::span<const std::uint8_t> report, std::string& text) {
  if (report.size() > kBootReportBytes) report = report.subspan(1);
  if (report.size() < kBootReportBytes) {
    text += kSubstitute;
    return;
  }
  std::array<std::uint8_t, kKeys> down{};
  std::copy_n(report.begin() + 2, kKeys, down.begin());
  for (const std::uint8_t usage : down) {
    if (usage == 0 || std::find(down_.begin(), down_.end(), usage) != down_.end()) continue;
    text += CharacterOf(usage, report[0]);
  }
  down_ = down;
}

void AppendReportText(std::span<const std::uint8_t> report, std::string& text) {
  bool end_alone = false;
  for (int k = 0; k < 2 && !report.empty() && !IsText(report.front()); ++k) {
    end_alone |= IsEnd(report.front());
    report = report.subspan(1);
  }
  if (end_alone && std::all_of(report.begin(), report.end(), [](auto byte) { return byte == 0; }))
    text += '\r';
  for (std::size_t k = 0; k < report.size(); ++k) {
    if (report[k] == 0) {  // what follows may be left from a longer text
      if (k > 0) text += '\r';
      return;
    }
    text += IsText(report[k]) || IsEnd(report[k]) ? static_cast<char>(report[k]) : kSubstitute;
  }
}

namespace {

constexpr std::size_t kMaxDigits = 10;

bool IsDigit(char c) {
  return c >= '0' && c <= '9';
}

bool IsBlank(char c) {
  return c == ' ' || c == '\t';
}

std::string_view Trimmed(std::string_view text) {
  while (!text.empty() && IsBlank(text.front())) text.remove_prefix(1);
  while (!text.empty() && IsBlank(text.back())) text.remove_suffix(1);
  return text;
}

/// Takes a decimal number off the front of `text`: a sign, which may be absent and followed by
/// blanks, and digits with at most one point. nullopt, and `text` unchanged, if there is none.
std::optional<double> TakeNumber(std::string_view& text) {
  std::string_view rest = text;
  bool negative = false;
  if (!rest.empty() && (rest.front() == '+' || rest.front() == '-')) {
    negative = rest.front() == '-';
    rest = Trimmed(rest.substr(1));
  }
  std::size_t length = 0, digits = 0, points = 0;
  for (; length < rest.size() && (IsDigit(rest[length]) || rest[length] == '.'); ++length) {
    (rest[length] == '.' ? points : digits) += 1;
  }
  if (digits == 0 || digits > kMaxDigits || points > 1) return std::nullopt;
  double number = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + length, number);
  if (error != std::errc() || end != rest.data() + length) return std::nullopt;
  text = rest.substr(length);
  return negative ? -number : number;
}

/// The unit that is the whole text; nullopt: none.
std::optional<GaugeUnit> UnitOf(std::string_view text) {
  if (text == "mm" || text == "MM") return GaugeUnit::kMillimetre;
  if (text == "in" || text == "IN" || text == "inch" || text == "INCH") return GaugeUnit::kInch;
  return std::nullopt;
}

/// A number alone, or followed by a unit.
/// @param separator  between number and unit; 0: blanks at most
GaugeLine NumberWithUnit(std::string_view text, char separator) {
  const std::optional<double> value = TakeNumber(text);
  if (!value) return {};
  text = Trimmed(text);
  if (separator != 0 && !text.empty()) {
    if (text.front() != separator) return {};
    text = Trimmed(text.substr(1));
    if (text.empty()) return {};
  }
  if (text.empty()) return {GaugeLine::Kind::kReading, *value, std::nullopt, {}};
  const std::optional<GaugeUnit> unit = UnitOf(text);
  if (!unit) return {};
  return {GaugeLine::Kind::kReading, *value, unit, {}};
}

GaugeLine Fault(std::string_view what) {
  return {GaugeLine::Kind::kFault, 0, std::nullopt, what};
}

/// "01A+0000.123": channel, A, sign and number of eight characters. Faults: "911" the gauge is
/// silent, "918" it is busy.
GaugeLine FromMitutoyo(std::string_view text) {
  if (text == "911") {
    return Fault("the adapter receives nothing from the gauge: switch it on and check its cable");
  }
  if (text == "918") return Fault("the gauge was busy: press its button again");
  if (text.size() != 12 || !IsDigit(text[0]) || !IsDigit(text[1]) || text[2] != 'A') return {};
  if (text[3] != '+' && text[3] != '-') return {};
  text.remove_prefix(3);
  const std::optional<double> value = TakeNumber(text);
  if (!value || !text.empty()) return {};
  return {GaugeLine::Kind::kReading, *value, std::nullopt, {}};
}

/// "+ 2.1380, MM".
GaugeLine FromStarrett(std::string_view text) {
  const GaugeLine line = NumberWithUnit(text, ',');
  return line.unit ? line : GaugeLine{};
}

/// "+12.345" in the unit that the gauge is set to. Faults: ERR0 to ERR3.
GaugeLine FromSylvac(std::string_view text) {
  if (text == "ERR0") return Fault("its sensor is faulty or dirty");
  if (text == "ERR1") return Fault("it received an unknown command");
  if (text == "ERR2") return Fault("parity error: check baud rate, parity and cable");
  if (text == "ERR3") return Fault("the reading is out of its range");
  if (text.empty() || (text.front() != '+' && text.front() != '-')) return {};
  const GaugeLine line = NumberWithUnit(text, 0);
  return line.unit ? GaugeLine{} : line;
}

/// "1 +123.45 mm": feature number, value, unit. Fault: ERR6.
GaugeLine FromMahr(std::string_view text) {
  if (text == "ERR6") return Fault("its measuring programme is not active");
  if (text.size() < 2 || !IsDigit(text[0]) || !IsBlank(text[1])) return {};
  const GaugeLine line = NumberWithUnit(Trimmed(text.substr(1)), 0);
  return line.unit ? line : GaugeLine{};
}

GaugeLine FromPlain(std::string_view text) {
  return NumberWithUnit(text, 0);
}

constexpr GaugeFormat kFormats[] = {
    {"mitutoyo",
     "Mitutoyo USB-ITN as a virtual serial port, QM-Height: 01A+0000.123",
     {},
     FromMitutoyo},
    {"starrett", "Starrett iQ: + 2.1380, MM", {}, FromStarrett},
    {"sylvac", "Sylvac OPTO-RS and relabelled gauges: +12.345", {4800, 7, 'E', 2}, FromSylvac},
    {"mahr", "Mahr Millimar C1202: 1 +123.45 mm", {9600, 7, 'E', 2}, FromMahr},
    {"plain", "a number, and mm or in after it: -0.125 mm", {}, FromPlain},
};

}  // namespace

double MetresPer(GaugeUnit unit) {
  return unit == GaugeUnit::kInch ? 0.0254 : 1e-3;
}

std::span<const GaugeFormat> GaugeFormats() {
  return kFormats;
}

const GaugeFormat* FindGaugeFormat(std::string_view name) {
  const auto* const found =
      std::find_if(std::begin(kFormats), std::end(kFormats),
                   [name](const GaugeFormat& format) { return format.name == name; });
  return found == std::end(kFormats) ? nullptr : found;
}

std::optional<std::string_view> LineReceiver::Push(char byte) {
  const bool ends = byte == '\r' || byte == '\n';
  if (!ends) {
    if (pending_.size() < kMaxLineBytes) pending_ += byte;
    if (pending_.size() == kMaxLineBytes) pending_.back() = kSubstitute;
    return std::nullopt;
  }
  line_ = Trimmed(pending_);
  pending_.clear();
  if (line_.empty()) return std::nullopt;
  return line_;
}

}  // namespace plumbline::gauge
