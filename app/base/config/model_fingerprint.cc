#include "app/base/config/model_fingerprint.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <sstream>
#include <string_view>

namespace plumbline::config {
namespace {

/// FNV-1a with 64 bits (draft-eastlake-fnv).
class Fnv1a {
 public:
  void Add(std::string_view bytes) {
    for (const char byte : bytes) AddByte(static_cast<unsigned char>(byte));
  }
  void Add(double number) {
    const auto bits = std::bit_cast<std::uint64_t>(number == 0 ? 0.0 : number);  // -0 is 0
    for (int shift = 0; shift < 64; shift += 8) {
      AddByte(static_cast<unsigned char>(bits >> shift & 0xff));
    }
  }
  std::uint64_t value() const { return value_; }

 private:
  void AddByte(unsigned char byte) {
    value_ ^= byte;
    value_ *= 0x100000001b3;
  }

  std::uint64_t value_ = 0xcbf29ce484222325;
};

/// Not part of the model: labels, and the fingerprint itself.
bool IsLeftOut(std::string_view path) {
  return path == "robot.name" || path == "robot.model" || path == "robot.series" ||
         path == "robot.installed" || path == "domain.fingerprint" ||
         (path.starts_with("effect[") && path.ends_with("].from"));
}

void AddNode(const toml::node& node, const std::string& path, Fnv1a& hash) {
  using std::string_view_literals::operator""sv;
  if (IsLeftOut(path)) return;
  if (const auto* table = node.as_table()) {
    for (const auto& [key, child] : *table) {  // sorted by key
      AddNode(child, path.empty() ? std::string(key.str()) : fmt::format("{}.{}", path, key.str()),
              hash);
    }
    return;
  }
  if (const auto* array = node.as_array()) {
    std::size_t count = 0;
    for (const toml::node& child : *array)
      AddNode(child, fmt::format("{}[{}]", path, ++count), hash);
    return;
  }
  hash.Add(path);
  if (const auto* number = node.as_floating_point()) {
    hash.Add("\0n"sv);
    hash.Add(number->get());
  } else if (const auto* integer = node.as_integer()) {
    hash.Add("\0n"sv);
    hash.Add(static_cast<double>(integer->get()));
  } else if (const auto* string = node.as_string()) {
    hash.Add("\0s"sv);
    hash.Add(string->get());
  } else {
    std::ostringstream text;
    node.visit([&text](const auto& value) { text << value; });
    hash.Add("\0o"sv);
    hash.Add(text.str());
  }
  hash.Add("\0"sv);
}

}  // namespace

std::string ModelFingerprint(const TomlDocument& document) {
  Fnv1a hash;
  AddNode(document.tree(), "", hash);
  return fmt::format("{:016x}", hash.value());
}

}  // namespace plumbline::config
