// Typed access to a TOML table; throws std::runtime_error with file and line.
#pragma once

#include <fmt/core.h>
#include <toml++/toml.h>

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/virtual_cell/rigid_motion.h"

namespace virtual_cell {

class TomlFields {
 public:
  TomlFields(const toml::table& table, std::string file) : table_(table), file_(std::move(file)) {}

  bool Has(const char* key) const { return table_.contains(key); }

  double Number(const char* key) const {
    const std::optional<double> value = table_[key].value<double>();
    if (!value) Fail(key, "a number is needed");
    return *value;
  }
  double Number(const char* key, double otherwise) const {
    return Has(key) ? Number(key) : otherwise;
  }
  std::string Text(const char* key) const {
    const std::optional<std::string> value = table_[key].value<std::string>();
    if (!value) Fail(key, "a text is needed");
    return *value;
  }
  std::string Text(const char* key, const std::string& otherwise) const {
    return Has(key) ? Text(key) : otherwise;
  }
  std::vector<double> Numbers(const char* key) const {
    const toml::array* array = table_[key].as_array();
    if (array == nullptr) Fail(key, "a list of numbers is needed");
    std::vector<double> values;
    for (const toml::node& node : *array) {
      const std::optional<double> value = node.value<double>();
      if (!value) Fail(key, "a list of numbers is needed");
      values.push_back(*value);
    }
    return values;
  }
  Vec3 Vector(const char* key) const {
    const std::vector<double> values = Numbers(key);
    if (values.size() != 3) Fail(key, "three numbers are needed");
    return {values[0], values[1], values[2]};
  }
  Vec3 Vector(const char* key, const Vec3& otherwise) const {
    return Has(key) ? Vector(key) : otherwise;
  }
  TomlFields Table(const char* key) const {
    const toml::table* table = table_[key].as_table();
    if (table == nullptr) Fail(key, "a table is needed");
    return {*table, file_};
  }
  /// The elements of `[[key]]`; empty if it is absent.
  std::vector<TomlFields> Tables(const char* key) const {
    std::vector<TomlFields> tables;
    if (!Has(key)) return tables;
    const toml::array* array = table_[key].as_array();
    if (array == nullptr) Fail(key, "a list of tables is needed");
    for (const toml::node& node : *array) {
      if (node.as_table() == nullptr) Fail(key, "a list of tables is needed");
      tables.emplace_back(*node.as_table(), file_);
    }
    return tables;
  }

  [[noreturn]] void Fail(const char* key, const std::string& reason) const {
    const toml::node* node = table_.get(key);
    const auto line = node != nullptr ? node->source().begin.line : table_.source().begin.line;
    throw std::runtime_error(fmt::format("{}:{} {}: {}", file_, line, key, reason));
  }

 private:
  const toml::table& table_;
  std::string file_;
};

/// Parses a file. @throws std::runtime_error with file, line and the parser's reason.
inline toml::table ParseTomlFile(const std::string& path) {
  try {
    return toml::parse_file(path);
  } catch (const toml::parse_error& error) {
    throw std::runtime_error(
        fmt::format("{}:{} {}", path, error.source().begin.line, error.description()));
  }
}

}  // namespace virtual_cell
