// TOML reader that finds every fault in one pass.
//
// A TomlDocument parses a text; keys are read through TomlTable handles. A faulty key is added to
// the FaultList with its line, its value and what is allowed, and the getter returns nullopt.
// ReportUnknownKeys() then reports every key that was never requested. The result depends on the
// text alone: no file is opened and no exception escapes.
#pragma once

#include <toml++/toml.h>

#include <Eigen/Core>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/config/fault.h"
#include "firmware-like/geometry/angle.h"
#include "firmware-like/geometry/length.h"
#include "firmware-like/geometry/pose.h"

namespace plumbline::config {

/// Allowed range of a number in the unit of the file, and its conversion factor to SI.
struct NumberRange {
  double min;
  double max;
  double to_si = 1;
};

/// `0..300`, or `0 or more` if there is no upper limit; in the unit of the file.
std::string RangeText(NumberRange range);

/// A word of the file and the value it represents.
template <typename T>
struct Choice {
  std::string_view word;
  T value;
};

class TomlDocument;

/// Handle to one table of a document. Getters convert to SI and return nullopt for a faulty value
/// or an absent key; for an absent key the Required forms also add a fault.
class TomlTable {
 public:
  bool Has(std::string_view key) const;  ///< does not mark the key as known

  std::optional<double> Number(std::string_view key, NumberRange range) const;
  std::optional<double> RequiredNumber(std::string_view key, NumberRange range) const;
  std::optional<int> Integer(std::string_view key, int min, int max) const;
  std::optional<int> RequiredInteger(std::string_view key, int min, int max) const;
  std::optional<bool> Bool(std::string_view key) const;
  std::optional<std::string> String(std::string_view key) const;  ///< never empty
  std::optional<std::string> RequiredString(std::string_view key) const;
  std::optional<Vec3> Vector3(std::string_view key, NumberRange range) const;
  std::optional<Vec3> RequiredVector3(std::string_view key, NumberRange range) const;

  /// A list of exactly `size` numbers; size < 0 allows any length.
  std::optional<std::vector<double>> Numbers(std::string_view key, NumberRange range,
                                             int size = -1) const;
  std::optional<std::vector<int>> Integers(std::string_view key, int min, int max) const;
  std::optional<std::vector<std::string>> Strings(std::string_view key) const;
  /// A list of `rows` lists of `columns` numbers each, scaled by range.to_si.
  std::optional<Eigen::MatrixXd> Matrix(std::string_view key, NumberRange range, int rows,
                                        int columns) const;

  /// A list of any number of rows, each a list of numbers; all rows have the same length.
  std::optional<Eigen::MatrixXd> Rows(std::string_view key, NumberRange range) const;

  /// "one of \"point\", \"plane\"".
  static std::string OneOfText(const std::vector<std::string_view>& words);
  /// Index of the key's value in `words`.
  std::optional<std::size_t> OneOf(std::string_view key,
                                   const std::vector<std::string_view>& words) const;
  template <typename T>
  std::optional<T> OneOf(std::string_view key, std::initializer_list<Choice<T>> choices) const {
    std::vector<std::string_view> words;
    for (const Choice<T>& choice : choices) words.push_back(choice.word);
    const std::optional<std::size_t> index = OneOf(key, words);
    if (!index) return std::nullopt;
    return (choices.begin() + *index)->value;
  }
  template <typename T>
  std::optional<T> RequiredOneOf(std::string_view key,
                                 std::initializer_list<Choice<T>> choices) const {
    std::vector<std::string_view> words;
    for (const Choice<T>& choice : choices) words.push_back(choice.word);
    if (!Has(key)) AddMissing(key, OneOfText(words));
    return OneOf(key, choices);
  }

  std::optional<TomlTable> Table(std::string_view key) const;
  std::optional<TomlTable> RequiredTable(std::string_view key) const;
  /// The `[[key]]` tables in order; empty if absent. An element that is not a table is a fault.
  std::vector<TomlTable> Tables(std::string_view key) const;
  /// The single `[key]`, or all `[[key]]` tables.
  std::vector<TomlTable> TableOrTables(std::string_view key) const;

  /// Adds the fault or warning `<value of key> <what>` at the key's line; if the key is absent,
  /// only `<what>` at the table's line.
  void AddFault(std::string_view key, std::string_view what) const;
  void AddWarning(std::string_view key, std::string_view what) const;
  /// Adds the fault that the key is missing; `expected` describes what to write.
  void AddMissing(std::string_view key, std::string_view expected) const;

  /// Marks keys as known without reading them; for keys whose meaning depends on another key that
  /// is absent or faulty.
  void Ignore(std::initializer_list<std::string_view> keys) const;

  int Line() const;
  std::string Text() const;                ///< the whole table as TOML, for comparison
  int LineOf(std::string_view key) const;  ///< the table's line if the key is absent
  std::string PathOf(std::string_view key) const;

 private:
  friend class TomlDocument;
  TomlTable(TomlDocument& document, const toml::table& table, std::string path);

  const toml::node* Find(std::string_view key) const;
  const toml::array* FindArray(std::string_view key, std::string_view expected, int size) const;
  std::optional<double> NumberFrom(const toml::node& node, const std::string& path,
                                   NumberRange range) const;
  std::optional<int> IntegerFrom(const toml::node& node, const std::string& path, int min,
                                 int max) const;
  std::optional<std::string> StringFrom(const toml::node& node, const std::string& path) const;
  void AddAt(const toml::node& node, const std::string& path, std::string what) const;
  void AddEntry(Fault::Severity severity, std::string_view key, std::string_view what) const;

  TomlDocument* document_;
  const toml::table* table_;
  std::string path_;
};

/// A parsed TOML text. `faults` must outlive the document, and the document its tables.
class TomlDocument {
 public:
  /// Invalid TOML is added as a fault with its line; the document is then empty.
  TomlDocument(std::string_view text, std::string file, FaultList& faults);
  TomlDocument(const TomlDocument&) = delete;
  TomlDocument& operator=(const TomlDocument&) = delete;

  bool parsed() const { return parsed_; }
  const std::string& file() const { return file_; }
  TomlTable Root();
  const toml::table& tree() const { return root_; }  ///< empty unless parsed()

  /// Adds a fault for each key that was never requested, with the nearest requested key as a
  /// suggestion. Keys inside an unknown table are not reported one by one.
  void ReportUnknownKeys();

 private:
  friend class TomlTable;
  struct KnownKeys {
    std::string path;  ///< of the table
    std::vector<std::string> keys;
  };

  std::string file_;
  FaultList& faults_;
  toml::table root_;
  bool parsed_ = false;
  std::map<const toml::table*, KnownKeys> known_keys_;
};

/// Reads a whole text: parses it, calls read(document) if it is TOML, and reports unknown keys.
/// @param faults  receives the faults and warnings of this text, sorted by line
/// @return        what `read` returned; nullopt if there is a fault
template <typename Read>
auto ReadDocument(std::string_view text, const std::string& file, FaultList& faults, Read read) {
  FaultList own;
  TomlDocument document(text, file, own);
  std::optional<decltype(read(document))> value;
  if (document.parsed()) {
    value = read(document);
    document.ReportUnknownKeys();
  }
  own.SortByLine();
  faults.Append(own);
  if (own.HasFaults()) value.reset();
  return value;
}

}  // namespace plumbline::config
