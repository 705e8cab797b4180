// Table of the kinds of a device: their names, and the creation of a device by name.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstddef>
#include <memory>
#include <string_view>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline {

template <typename Device, typename Connection>
struct DeviceKind {
  std::string_view name;
  Result<std::unique_ptr<Device>> (*make)(const Connection&);
};

template <typename Device, typename Connection, std::size_t N>
std::vector<std::string_view> NamesOf(const DeviceKind<Device, Connection> (&kinds)[N]) {
  std::vector<std::string_view> names;
  names.reserve(N);
  for (const auto& kind : kinds) names.push_back(kind.name);
  return names;
}

/// @param what  "camera", for the error if no kind has that name
template <typename Device, typename Connection, std::size_t N>
Result<std::unique_ptr<Device>> MakeOfKind(const DeviceKind<Device, Connection> (&kinds)[N],
                                           std::string_view what, std::string_view name,
                                           const Connection& connection) {
  for (const auto& kind : kinds) {
    if (kind.name == name) return kind.make(connection);
  }
  return Error{
      fmt::format("{} \"{}\" is not one of {}", what, name, fmt::join(NamesOf(kinds), ", "))};
}

}  // namespace plumbline
