// Outline of a file of unknown kind: encoding, syntax, and named values with their lines.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/text/delimited_text.h"

namespace plumbline::recognition {

enum class Syntax { kEmpty, kBinary, kXml, kBraces, kYaml, kToml, kPlain };

/// A named value: an element or attribute of XML, or a key of JSON, YAML or TOML.
struct Entry {
  /// Names from the outside in, joined by dots: "robot.joint.origin@xyz" for an attribute,
  /// "camera_matrix.data" for a key. Lists do not appear in it, except block lists of YAML, whose
  /// scalars are entries of the same path.
  std::string path;
  std::string_view value;  ///< as written, without quotes; a list of numbers is one value
  int line = 0;            ///< from 1
};

/// A line of text.
struct Line {
  std::string_view text;  ///< without leading and trailing blanks
  int number = 0;         ///< from 1
};

/// What can be found without knowing the kind. Scans tolerate faults, so that a damaged or cut file
/// is still recognised; each is linear in the size of the file.
class Outline {
 public:
  /// @param bytes  must outlive the object
  /// @param name   of the file; only its last part is used
  Outline(std::string_view bytes, std::string_view name);
  Outline(const Outline&) = delete;
  Outline& operator=(const Outline&) = delete;
  ~Outline() = default;

  std::string_view bytes() const { return bytes_; }
  /// The last part of the name, and what follows its last dot, in lower case.
  const std::string& name() const { return name_; }
  const std::string& extension() const { return extension_; }
  Syntax syntax() const { return syntax_; }
  /// "UTF-8", "UTF-16" or "Windows-1252"; empty for binary files.
  const std::string& encoding() const { return encoding_; }
  /// UTF-8; empty for binary files.
  std::string_view text() const { return text_; }
  int line_count() const { return line_count_; }
  /// The first lines that are not empty, at most kHeadLines.
  const std::vector<Line>& head() const { return head_; }
  /// In the order of the text, at most kMostEntries.
  const std::vector<Entry>& entries() const { return entries_; }
  bool entries_cut() const { return entries_.size() == kMostEntries; }
  /// What is open where an XML, JSON or list ends too early: "<robot>", "[ of line 7".
  const std::string& open_at_end() const { return open_at_end_; }
  /// What follows after the last brace of JSON, and its line; empty if nothing does.
  const std::string& text_after() const { return text_after_; }
  int line_after() const { return line_after_; }
  /// The layout as a table, of the first kTableBytes; nullopt for XML and binary files.
  const std::optional<text::DelimitedText>& table() const { return table_; }

  /// The first entry of a path, or nullptr.
  const Entry* Find(std::string_view path) const;
  /// The first entry whose path is `name` or ends in `.name`, in any case of letters.
  const Entry* FindName(std::string_view name) const;
  std::size_t Count(std::string_view path) const;
  /// The first of the head lines that starts with `start`, in any case of letters.
  const Line* FindLine(std::string_view start) const;
  /// The line in which a position of text() lies.
  int LineAt(std::size_t position) const;

  static constexpr std::size_t kMostEntries = 20'000;
  static constexpr std::size_t kHeadLines = 400;
  static constexpr std::size_t kTableBytes = 64 * 1024;

 private:
  void FindHead();
  void ChooseSyntax();

  std::string_view bytes_;
  std::string name_, extension_, encoding_, text_, open_at_end_, text_after_;
  Syntax syntax_ = Syntax::kPlain;
  int line_count_ = 0, line_after_ = 0;
  std::vector<Line> head_;
  std::vector<Entry> entries_;
  std::optional<text::DelimitedText> table_;
};

/// All numbers of an entry: of a list in brackets, of words separated by blanks or commas, or of
/// the entries of a block list that start at it. Empty if it holds anything else.
std::vector<double> NumbersOf(const Outline& outline, const Entry* entry);
/// The number of an entry; nullopt if it is not exactly one.
std::optional<double> NumberOf(const Outline& outline, const Entry* entry);

/// True if the text starts with `start`, in any case of ASCII letters.
bool StartsWith(std::string_view text, std::string_view start);
std::string InLowerCase(std::string_view text);
std::string_view Trimmed(std::string_view text);

}  // namespace plumbline::recognition
