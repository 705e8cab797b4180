// Configuration schema visitor: one listing of a table's keys serves both reading and documenting.
#pragma once

#include <concepts>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "app/base/config/named_files.h"
#include "app/base/config/toml_reader.h"

namespace plumbline::config {

/// Documentation of a key, beyond its type, range and default.
struct SettingDoc {
  std::string_view description{};
  std::string_view example{};       ///< TOML value shown instead of the default
  std::string_view default_text{};  ///< the default in words, if it is not a constant
  bool required = false;
  bool active = false;  ///< not commented out in the shipped file
  int first_cell_step =
      0;  ///< position among the lines to edit for a first cell; 0: not among them
};

constexpr SettingDoc Required(std::string_view description, std::string_view example,
                              bool when = true) {
  return {.description = description, .example = example, .required = when};
}
/// Documentation of a key that a first cell needs; the shipped file sets it.
/// @param step  SettingDoc::first_cell_step
constexpr SettingDoc FirstCell(int step, std::string_view description, std::string_view example,
                               bool required = true) {
  return {.description = description,
          .example = example,
          .required = required,
          .active = true,
          .first_cell_step = step};
}

/// One key as it appears in the generated documents.
struct Setting {
  std::string key, type, range;
  std::string value;  ///< the default as TOML; empty if there is none
  SettingDoc doc;
};

/// Passed to a ListKeys() function together with the struct that holds a table's values.
/// Constructed from a TomlTable, it reads: each key is checked and stored; an absent or faulty key
/// leaves the struct's default. Constructed from a list of rows, it documents: each key becomes a
/// row, and the value found in the struct is its default.
class Settings {
 public:
  /// @param files  resolves the paths of Path(); may be null if the table has none
  explicit Settings(const TomlTable& table, const NamedFiles* files = nullptr)
      : table_(table), files_(files) {}
  explicit Settings(std::vector<Setting>& rows) : rows_(&rows) {}

  void Add(std::string_view key, double& value, NumberRange range, const SettingDoc& doc);
  void Add(std::string_view key, std::optional<double>& value, NumberRange range,
           const SettingDoc& doc);
  void Add(std::string_view key, Vec3& value, NumberRange range, const SettingDoc& doc);
  void Add(std::string_view key, std::optional<Vec3>& value, NumberRange range,
           const SettingDoc& doc);
  void Add(std::string_view key, std::optional<std::vector<double>>& value, NumberRange range,
           const SettingDoc& doc);
  void Add(std::string_view key, std::optional<int>& value, NumberRange range,
           const SettingDoc& doc);
  void Add(std::string_view key, std::vector<int>& value, NumberRange range, const SettingDoc& doc);
  template <std::integral T>
  void Add(std::string_view key, T& value, NumberRange range, const SettingDoc& doc) {
    const auto scale = static_cast<T>(range.to_si);
    std::optional<int> found = static_cast<int>(value / scale);
    Add(key, found, range, doc);
    if (found) value = static_cast<T>(static_cast<T>(*found) * scale);
  }
  void Add(std::string_view key, bool& value, const SettingDoc& doc);
  void Add(std::string_view key, std::string& value, const SettingDoc& doc);
  void Add(std::string_view key, std::vector<std::string>& value, const SettingDoc& doc);

  /// A path, resolved relative to the configuration file.
  void Path(std::string_view key, std::string& value, const SettingDoc& doc);

  /// An enumeration: one of several words, each with the value it represents.
  template <typename T>
  void Choose(std::string_view key, T& value,
              const std::vector<Choice<std::type_identity_t<T>>>& choices, const SettingDoc& doc) {
    std::vector<std::string_view> words;
    std::string_view word;
    for (const Choice<T>& choice : choices) {
      words.push_back(choice.word);
      if (choice.value == value) word = choice.word;
    }
    if (const auto index = Word(key, word, words, doc)) {
      value = choices[*index].value;
    }
  }

  /// Documents a key that the caller reads itself.
  void Document(std::string_view key, std::string_view type, const SettingDoc& doc);

  /// Adds the fault `<value of key> <what>` at the key's line; no effect in documentation mode.
  void AddFault(std::string_view key, std::string_view what);

  /// False once a key was present but faulty.
  bool valid() const { return valid_; }

 private:
  std::optional<std::size_t> Word(std::string_view key, std::string_view value,
                                  const std::vector<std::string_view>& words,
                                  const SettingDoc& doc);
  /// Adds a row in documentation mode.
  /// @return  true in documentation mode: there is nothing to read then
  bool AddRow(std::string_view key, std::string_view type, std::string range, std::string value,
              const SettingDoc& doc);
  /// Stores the value that a getter of the table returned, if any.
  template <typename Found, typename T>
  void Store(std::string_view key, Found found, T& value);

  std::optional<TomlTable> table_;
  const NamedFiles* files_ = nullptr;
  std::vector<Setting>* rows_ = nullptr;
  bool valid_ = true;
};

/// Reads the keys that ListKeys() lists for a Config.
/// @return  false if a key is present but faulty
template <typename Config>
bool ReadKeys(const TomlTable& table, Config& config, const NamedFiles* files = nullptr) {
  Settings keys(table, files);
  ListKeys(keys, config);
  return keys.valid();
}

}  // namespace plumbline::config
