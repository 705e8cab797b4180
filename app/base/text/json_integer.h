// Range-checked integers from JSON.
//
// For text from files and other processes: the JSON library itself converts any number silently.
#pragma once

#include <concepts>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <utility>

namespace plumbline::text {

/// The value, or nullopt if it is not an integer that fits T.
template <std::integral T, typename Json>
std::optional<T> IntegerFromJsonIfValid(const Json& json) {
  const bool fits =
      json.is_number_unsigned()
          ? std::in_range<T>(json.template get<std::uint64_t>())
          : json.is_number_integer() && std::in_range<T>(json.template get<std::int64_t>());
  return fits ? std::optional(json.template get<T>()) : std::nullopt;
}

/// @throws std::out_of_range if it is not an integer that fits T
template <std::integral T, typename Json>
T IntegerFromJson(const Json& json) {
  const std::optional<T> number = IntegerFromJsonIfValid<T>(json);
  if (!number) throw std::out_of_range("a value that is no whole number, or too large a one");
  return *number;
}

}  // namespace plumbline::text
