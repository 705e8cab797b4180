// TOML reader that finds every fault in one pass.
//
// A TomlDocument parses a text; keys are read through TomlTable handles. A faulty key is added to
// the FaultList with its line, its value and what is allowed, and the getter returns nullopt.
// ReportUnknownKeys() then reports every key that was never requested. The result depends on the
// text alone: no file is opened and no exception escapes.
#pragma once

#include <toml++/toml.h>

#include <Eigen/Core>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/config/fault.h"
#include "firmware-like/geometry/pose.h"
#include "firmware-like/geometry/units.h"

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

/// True for a table without a key, whose subtables have none either, and for a list of such tables.
/// They count as absent, so that a file can show the header of a table that it does not use, and a
/// key that is added below it takes effect in that table.
bool IsEmptyTable(const toml::node& node);

/// Handle to one table of a document. Getters convert to SI and return nullopt for a faulty value
/// or an absent key; for an absent key the Required forms also add a fault.
class TomlTable {
 public:
  /// False for an empty table. Does not mark the key as known.
  bool Has(std::string_view key) const;

  std::optional<double> Number(std::string_view key, NumberRange range) const;
  std::optional<double> RequiredNumber(std::string_view key, NumberRange range) const;
  std::optional<int> Integer(std::string_view key, int min, int max) const;
  std::optional<int> RequiredInteger(std::string_view key, int min, int max) const;
  std::optional<bool> Bool(std::string_view key) const;
  std::optional<std::string> String(std::string_view key) const;  ///< never empty
  std::optional<std::string> Date(std::string_view key) const;    ///< "2019-05-01"
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

  std::optional<TomlTable> Table(std::string_view key) const;  ///< nullopt if absent or empty
  /// Also returns an empty table, whose required keys are then missing.
  std::optional<TomlTable> RequiredTable(std::string_view key) const;
  /// The `[[key]]` tables in order; none if absent, or if all are empty. An element that is not a
  /// table is a fault.
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

/// True if the parser accepts the text.
bool IsToml(std::string_view text);

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

  /// Adds a fault for each key below a commented-out table header that belongs to that table, and
  /// removes the other faults of its line. Call before ReportUnknownKeys().
  /// @param text  of this document
  /// @param read  the reader of such a document. It also reads copies of the text in which a header
  ///              is not commented out, to find out which keys the table has.
  void ReportMisplacedKeys(std::string_view text, const std::function<void(TomlDocument&)>& read);

  /// Adds a fault for each key that was never requested, with the tables that have such a key or
  /// the nearest requested key as a suggestion. Keys inside an unknown table are not reported one
  /// by one.
  /// @param headers_with  further headers of tables with this key, "[page]"
  void ReportUnknownKeys(
      const std::function<std::vector<std::string>(std::string_view key)>& headers_with = {});

 private:
  friend class TomlTable;
  struct KnownKeys {
    std::string path;  ///< of the table
    std::vector<std::string> keys;
  };

  struct MisplacedKey {
    int line;
    std::string key;
  };
  /// The requested keys of the table whose header is in line `header`, in front of line `end`.
  std::vector<MisplacedKey> KeysOfTableAt(int header, int end) const;

  std::string file_;
  FaultList& faults_;
  toml::table root_;
  bool parsed_ = false;
  std::set<int> misplaced_lines_;
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
    document.ReportMisplacedKeys(text, [&read](TomlDocument& copy) { read(copy); });
    document.ReportUnknownKeys();
  }
  own.SortByLine();
  faults.Append(own);
  if (own.HasFaults()) value.reset();
  return value;
}

}  // namespace plumbline::config
