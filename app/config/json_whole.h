// Whole numbers of a JSON text that comes from another process or from a file: the library's own
// conversion takes any number.
#pragma once

#include <concepts>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <utility>

namespace plumbline {

/// The number; nothing where it is no whole one that T holds.
template <std::integral T, typename Json>
std::optional<T> WholeIfAny(const Json& json) {
  const bool held =
      json.is_number_unsigned()
          ? std::in_range<T>(json.template get<std::uint64_t>())
          : json.is_number_integer() && std::in_range<T>(json.template get<std::int64_t>());
  return held ? std::optional(json.template get<T>()) : std::nullopt;
}

/// @throws std::out_of_range where it is none
template <std::integral T, typename Json>
T WholeOf(const Json& json) {
  const std::optional<T> number = WholeIfAny<T>(json);
  if (!number) throw std::out_of_range("a value that is no whole number, or too large a one");
  return *number;
}

}  // namespace plumbline
