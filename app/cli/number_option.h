// Validators for numbers on the command line: finite and within limits.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace plumbline::cli {

/// The number, or nullopt for any other text, including "nan" and "inf".
inline std::optional<double> FiniteNumberFromText(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

/// For options that take an integer. Used instead of CLI::Range, which accepts nan and words its
/// messages differently.
inline CLI::Validator WholeNumberWithin(std::int64_t min, std::int64_t max) {
  return {[min, max](const std::string& text) {
            std::int64_t value = 0;
            const char* const end = text.data() + text.size();
            const auto [read, error] = std::from_chars(text.data(), end, value);
            if (error == std::errc() && read == end && value >= min && value <= max) {
              return std::string();
            }
            return fmt::format("{} is not a whole number from {} to {}", text, min, max);
          },
          fmt::format("[{}..{}]", min, max)};
}

/// For options that take a number. Used instead of CLI::Range, which accepts nan.
inline CLI::Validator NumberWithin(double min, double max) {
  return {[min, max](const std::string& text) {
            const auto value = FiniteNumberFromText(text);
            if (value && *value >= min && *value <= max) return std::string();
            return fmt::format("{} is not a number from {:g} to {:g}", text, min, max);
          },
          fmt::format("[{:g}..{:g}]", min, max)};
}

}  // namespace plumbline::cli
