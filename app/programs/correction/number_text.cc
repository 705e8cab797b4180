#include "app/programs/correction/number_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace plumbline::programs {
namespace {

/// The parts of a number as it is written.
struct Written {
  bool plus = false;       ///< with a sign although it is positive
  bool zero_leads = true;  ///< of a number below 1: 0.5, not .5
  bool below_one = false;  ///< tells whether zero_leads is known
  int decimals = 0;        ///< of the mantissa
  int significant = 0;
  char exponent = 0;  ///< 'e' or 'E'; 0: none
  int exponent_digits = 0;
  bool exponent_plus = false;
};

Written PartsOf(std::string_view text) {
  Written parts;
  if (text.starts_with('+')) parts.plus = true;
  if (text.starts_with('+') || text.starts_with('-')) text.remove_prefix(1);
  if (const auto e = text.find_first_of("eE"); e != std::string_view::npos) {
    parts.exponent = text[e];
    std::string_view digits = text.substr(e + 1);
    parts.exponent_plus = digits.starts_with('+');
    if (digits.starts_with('+') || digits.starts_with('-')) digits.remove_prefix(1);
    parts.exponent_digits = static_cast<int>(digits.size());
    text = text.substr(0, e);
  }
  const auto point = std::min(text.find('.'), text.size());
  const std::string_view whole = text.substr(0, point);
  parts.decimals = point < text.size() ? static_cast<int>(text.size() - point - 1) : 0;
  parts.below_one = whole.empty() || whole == "0";
  parts.zero_leads = !whole.empty();
  bool counting = false;
  for (const char c : text) {
    if (c == '.') continue;
    counting = counting || c != '0';
    parts.significant += counting ? 1 : 0;
  }
  return parts;
}

std::string WithoutLeadingZero(std::string text) {
  const std::size_t zero = text.starts_with('-') ? 1 : 0;
  if (text.compare(zero, 2, "0.") == 0) text.erase(zero, 1);
  return text;
}

/// A number that rounds to zero has no sign.
std::string WithoutMinusZero(std::string text) {
  if (text.starts_with('-') && text.find_first_of("123456789") == std::string::npos)
    text.erase(0, 1);
  return text;
}

int WholeDigits(double value) {
  const double magnitude = std::abs(value);
  return magnitude < 1 ? 0 : static_cast<int>(std::floor(std::log10(magnitude))) + 1;
}

std::string WithExponent(const Written& old, double value, const NumberStyle& style) {
  const int digits = std::max({old.decimals, old.significant - 1, style.least_significant - 1});
  std::string text = fmt::format("{:.{}e}", value, std::min(digits, 16));
  const auto e = text.find('e');
  std::string exponent = text.substr(e + 1);
  const bool negative = exponent.starts_with('-');
  exponent.erase(0, std::min(exponent.find_first_not_of("+-0"), exponent.size()));
  const int width = old.exponent == 0 ? 2 : old.exponent_digits;
  if (static_cast<int>(exponent.size()) < width)
    exponent.insert(0, static_cast<std::size_t>(width) - exponent.size(), '0');
  if (exponent.empty()) exponent = "0";
  return text.substr(0, e) + (old.exponent == 0 ? 'E' : old.exponent) +
         (negative            ? "-"
          : old.exponent_plus ? "+"
                              : "") +
         exponent;
}

std::string Plain(const Written& old, double value, const NumberStyle& style) {
  int decimals = std::max(old.exponent == 0 ? old.decimals : 0, style.least_decimals);
  const int significant =
      style.least_significant == 0
          ? 0
          : std::max(old.exponent == 0 ? 0 : old.significant, style.least_significant);
  decimals = std::max(decimals, significant - std::max(WholeDigits(value), 1));
  std::string text = WithoutMinusZero(fmt::format("{:.{}f}", value, std::min(decimals, 17)));
  const bool leads = old.zero_leads || !old.below_one || old.exponent != 0;
  return leads ? text : WithoutLeadingZero(std::move(text));
}

}  // namespace

std::optional<double> NumberFromText(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

std::optional<std::string> FormattedLike(std::string_view old_text, double old_value, double value,
                                         const NumberStyle& style, double turn) {
  if (turn > 0 && std::isfinite(value)) {
    value += turn * std::round((old_value - value) / turn);
    auto text = FormattedLike(old_text, old_value, value, style);
    const auto rounded = text ? NumberFromText(*text) : std::nullopt;
    if (!rounded || std::abs(old_value) > turn / 2) return text;
    const double beyond = std::abs(*rounded) - turn / 2;
    if (beyond <= 0.5 * std::pow(10.0, -PartsOf(*text).decimals)) return text;
    return FormattedLike(old_text, old_value, value - std::copysign(turn, value), style);
  }
  constexpr double kLargest = 1e15;
  const std::optional<double> read = NumberFromText(old_text);
  const double close = 1e-9 * std::max(1.0, std::abs(old_value));
  if (!read || std::abs(*read - old_value) > close) return std::nullopt;
  if (!std::isfinite(value) || std::abs(value) > kLargest) return std::nullopt;
  const Written old = PartsOf(old_text);
  std::string text;
  if (style.integers) {
    text = WithoutMinusZero(fmt::format("{:.0f}", value));
  } else if (style.fixed) {
    text = WithoutMinusZero(fmt::format("{:.{}f}", value, std::clamp(style.least_decimals, 0, 17)));
    if (!old.below_one || !old.zero_leads) text = WithoutLeadingZero(std::move(text));
  } else {
    // An exponent stays where plain digits would hide the value.
    const bool small = value != 0 && (std::abs(value) < 1e-3 || std::abs(value) >= 1e7);
    text = old.exponent != 0 && small && style.exponent ? WithExponent(old, value, style)
                                                        : Plain(old, value, style);
  }
  // Digits that stay the same stay as they are written.
  const double least = 0.5000001 * std::pow(10.0, -PartsOf(text).decimals);
  const bool exponent = text.find_first_of("eE") != std::string::npos;
  const double allowed = exponent ? 1e-12 * std::abs(old_value) : least;
  if (std::abs(value - old_value) < allowed) return std::string(old_text);
  if (old.plus && !text.starts_with('-')) text.insert(0, 1, '+');
  return text;
}

std::optional<Edit> NumberEdit(std::string_view bytes, const Number& number, double value,
                               const NumberStyle& style, double turn) {
  const Span& span = number.span;
  if (span.begin >= span.end || span.end > bytes.size()) return std::nullopt;
  const std::string_view old = bytes.substr(span.begin, span.end - span.begin);
  std::optional<std::string> text = FormattedLike(old, number.value, value, style, turn);
  if (!text) return std::nullopt;
  Edit edit{span.file, span.begin, span.end, std::move(*text)};
  if (!style.fixed || edit.text == old) return edit;
  const std::size_t width = span.end - span.begin;
  if (edit.text.size() < width) {
    edit.text.insert(0, width - edit.text.size(), ' ');
  } else {
    // One blank stays between the number and what is before it.
    for (std::size_t more = edit.text.size() - width; more > 0; --more) {
      const bool blanks =
          edit.begin >= 2 && bytes[edit.begin - 1] == ' ' && bytes[edit.begin - 2] == ' ';
      if (!blanks) break;
      --edit.begin;
    }
  }
  return edit;
}

}  // namespace plumbline::programs
