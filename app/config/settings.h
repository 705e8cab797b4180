// The keys of one table of a configuration file, each listed once: to be read, and to be
// documented.
#pragma once

#include <concepts>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "app/config/named_files.h"
#include "app/config/toml_reader.h"

namespace plumbline {

/// What the documents say about a key beside its type, range and default.
struct Meaning {
  std::string_view sentence{};
  std::string_view example{};    ///< TOML value to show instead of the default
  std::string_view otherwise{};  ///< the default in words, where it is not a constant
  bool required = false;
  bool active = false;  ///< not commented out in the shipped file
  int step = 0;         ///< number of the line among those that a first cell must edit
};

constexpr Meaning Required(std::string_view sentence, std::string_view example, bool when = true) {
  return {.sentence = sentence, .example = example, .required = when};
}
/// Of a key that a first cell needs.
/// @param step  0: the line is not one of those to be edited
constexpr Meaning FirstCell(int step, std::string_view sentence, std::string_view example,
                            bool required = true) {
  return {
      .sentence = sentence, .example = example, .required = required, .active = true, .step = step};
}

/// A key as the documents show it.
struct Setting {
  std::string key, type, range;
  std::string value;  ///< the default as TOML; empty if there is none
  Meaning meaning;
};

/// A function that lists the keys of a table, such as ListKeys(), takes a Settings and the struct
/// that the values belong to. It serves two purposes: with a TomlTable each key is checked and
/// stored, and a key that is absent or faulty leaves the struct's default; with a list of rows each
/// key becomes a row that documents it, and the value found in the struct is its default.
class Settings {
 public:
  /// @param files  resolves the paths of Path(); may be null if the table has none
  explicit Settings(const TomlTable& table, const NamedFiles* files = nullptr)
      : table_(table), files_(files) {}
  explicit Settings(std::vector<Setting>& rows) : rows_(&rows) {}

  void Add(std::string_view key, double& value, NumberRange range, const Meaning& meaning);
  void Add(std::string_view key, std::optional<double>& value, NumberRange range,
           const Meaning& meaning);
  void Add(std::string_view key, Vec3& value, NumberRange range, const Meaning& meaning);
  void Add(std::string_view key, std::optional<Vec3>& value, NumberRange range,
           const Meaning& meaning);
  void Add(std::string_view key, std::optional<std::vector<double>>& value, NumberRange range,
           const Meaning& meaning);
  void Add(std::string_view key, std::optional<int>& value, NumberRange range,
           const Meaning& meaning);
  void Add(std::string_view key, std::vector<int>& value, NumberRange range,
           const Meaning& meaning);
  template <std::integral T>
  void Add(std::string_view key, T& value, NumberRange range, const Meaning& meaning) {
    const auto scale = static_cast<T>(range.to_si);
    std::optional<int> found = static_cast<int>(value / scale);
    Add(key, found, range, meaning);
    if (found) value = static_cast<T>(static_cast<T>(*found) * scale);
  }
  void Add(std::string_view key, bool& value, const Meaning& meaning);
  void Add(std::string_view key, std::string& value, const Meaning& meaning);
  void Add(std::string_view key, std::vector<std::string>& value, const Meaning& meaning);

  /// A path, resolved relative to the configuration file.
  void Path(std::string_view key, std::string& value, const Meaning& meaning);

  /// One of some words, each with the value it stands for.
  template <typename T>
  void Choose(std::string_view key, T& value,
              const std::vector<Choice<std::type_identity_t<T>>>& choices, const Meaning& meaning) {
    std::vector<std::string_view> words;
    std::string_view word;
    for (const Choice<T>& choice : choices) {
      words.push_back(choice.word);
      if (choice.value == value) word = choice.word;
    }
    if (const auto index = Word(key, word, words, meaning)) {
      value = choices[*index].value;
    }
  }

  /// A key that the caller reads itself.
  void Document(std::string_view key, std::string_view type, const Meaning& meaning);

  /// False once a key was present but not usable.
  bool good() const { return good_; }

 private:
  std::optional<std::size_t> Word(std::string_view key, std::string_view value,
                                  const std::vector<std::string_view>& words,
                                  const Meaning& meaning);
  /// Stores a row if the keys are documented.
  /// @return  whether the key is documented, so that there is nothing to read
  bool Row(std::string_view key, std::string_view type, std::string range, std::string value,
           const Meaning& meaning);
  /// What a getter of the table returned, if it returned a value.
  template <typename Found, typename T>
  void Store(std::string_view key, Found found, T& value);

  std::optional<TomlTable> table_;
  const NamedFiles* files_ = nullptr;
  std::vector<Setting>* rows_ = nullptr;
  bool good_ = true;
};

/// Reads the keys that ListKeys() lists for a Config.
/// @return  false if a key is present but not usable
template <typename Config>
bool ReadKeys(const TomlTable& table, Config& config, const NamedFiles* files = nullptr) {
  Settings keys(table, files);
  ListKeys(keys, config);
  return keys.good();
}

}  // namespace plumbline
