// Reading TOML so that every fault is found in one pass.
//
// A TomlDocument parses a text; TomlTable handles ask it for keys. A key that cannot be used is
// added to the FaultList with its line, value and what is allowed, and the getter answers
// nothing. ReportUnknownKeys() then names every key that nobody asked for. A pure function of
// the text: no file is opened and no exception leaves.
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

namespace plumbline {

/// What a number may be, in the unit of the file, and the factor that turns it into SI.
struct NumberRange {
  double min;
  double max;
  double to_si = 1;
};

/// `0..300`, or `0 or more` without an upper limit; in the unit of the file.
std::string RangeText(NumberRange range);

/// A word of the file and the value it stands for.
template <typename T>
struct Choice {
  std::string_view word;
  T value;
};

class TomlDocument;

/// A handle to one table of a document. Getters convert to SI; the plain form answers nothing
/// where the key is absent, the Required form adds a fault then. Neither answers a faulty value.
class TomlTable {
 public:
  bool Has(std::string_view key) const;  ///< present; does not count as asking for it

  std::optional<double> Number(std::string_view key, NumberRange range) const;
  std::optional<double> RequiredNumber(std::string_view key, NumberRange range) const;
  std::optional<int> Integer(std::string_view key, int min, int max) const;
  std::optional<int> RequiredInteger(std::string_view key, int min, int max) const;
  std::optional<bool> Bool(std::string_view key) const;
  std::optional<std::string> String(std::string_view key) const;  ///< never empty
  std::optional<std::string> RequiredString(std::string_view key) const;
  std::optional<Vec3> Vector3(std::string_view key, NumberRange range) const;
  std::optional<Vec3> RequiredVector3(std::string_view key, NumberRange range) const;

  /// A list of exactly `size` numbers (any number of them where size < 0).
  std::optional<std::vector<double>> Numbers(std::string_view key, NumberRange range,
                                             int size = -1) const;
  std::optional<std::vector<int>> Integers(std::string_view key, int min, int max) const;
  std::optional<std::vector<std::string>> Strings(std::string_view key) const;
  /// A list of `rows` lists of `columns` numbers each; unscaled where range.to_si is 1.
  std::optional<Eigen::MatrixXd> Matrix(std::string_view key, NumberRange range, int rows,
                                        int columns) const;

  /// A list of lists of numbers, all of the same length.
  std::optional<Eigen::MatrixXd> Rows(std::string_view key, NumberRange range) const;

  /// The index of the word that the key has.
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
    if (!Has(key)) AddMissing(key, "a word");
    return OneOf(key, choices);
  }

  std::optional<TomlTable> Table(std::string_view key) const;
  std::optional<TomlTable> RequiredTable(std::string_view key) const;
  /// `[[key]]`, in order; empty where absent. An element that is no table is a fault.
  std::vector<TomlTable> Tables(std::string_view key) const;
  /// `[key]` alone, or each `[[key]]`.
  std::vector<TomlTable> TableOrTables(std::string_view key) const;

  /// Adds `<value of key> <what>` as a fault (or warning) at the key's line; where the key is
  /// absent only `what`, at the table's line.
  void AddFault(std::string_view key, std::string_view what) const;
  void AddWarning(std::string_view key, std::string_view what) const;
  /// Adds a fault that key is missing; `expected` says what should stand there.
  void AddMissing(std::string_view key, std::string_view expected) const;

  /// Counts keys as asked for, so that they are not unknown: those whose meaning hangs on a key
  /// that is itself faulty.
  void Ignore(std::initializer_list<std::string_view> keys) const;

  int Line() const;
  std::string Text() const;                ///< the whole table as TOML, to compare it by
  int LineOf(std::string_view key) const;  ///< the table's line where key is absent
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
  /// A text that is no TOML becomes a fault with its line, and an empty document.
  TomlDocument(std::string_view text, std::string file, FaultList& faults);
  TomlDocument(const TomlDocument&) = delete;
  TomlDocument& operator=(const TomlDocument&) = delete;

  bool parsed() const { return parsed_; }
  const std::string& file() const { return file_; }
  TomlTable Root();
  const toml::table& tree() const { return root_; }  ///< empty unless parsed()

  /// Adds a fault for each key that was never asked for, with the nearest key that was.
  /// Keys below a table that nobody asked for are not told one by one.
  void ReportUnknownKeys();

 private:
  friend class TomlTable;
  struct Asked {
    std::string path;
    std::vector<std::string> keys;
  };

  std::string file_;
  FaultList& faults_;
  toml::table root_;
  bool parsed_ = false;
  std::map<const toml::table*, Asked> asked_;
};

}  // namespace plumbline
