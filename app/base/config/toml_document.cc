// TomlDocument: parsing, misplaced and unknown keys. The getters of TomlTable are in
// toml_reader.cc.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>

#include "app/base/config/header_lines.h"
#include "app/base/config/toml_error.h"
#include "app/base/config/toml_reader.h"
#include "app/base/text/text.h"

namespace plumbline::config {

namespace {

/// True if a key is in a line between two others, not counting the headers of tables.
bool HasKeyBetween(const toml::table& table, int after, int before) {
  return std::any_of(table.begin(), table.end(), [&](const auto& entry) {
    const auto line = static_cast<int>(entry.first.source().begin.line);
    if (const auto* inner = entry.second.as_table(); inner != nullptr && !inner->is_inline()) {
      return HasKeyBetween(*inner, after, before);
    }
    const auto* array = entry.second.as_array();
    if (array != nullptr && array->is_array_of_tables()) {
      return std::any_of(array->begin(), array->end(), [&](const toml::node& element) {
        return HasKeyBetween(*element.as_table(), after, before);
      });
    }
    return line > after && line < before;
  });
}

}  // namespace

bool IsToml(std::string_view text) {
  if (text::LineNestedTooDeepInToml(text)) return false;
  try {
    static_cast<void>(toml::parse(text));
    return true;
  } catch (const toml::parse_error&) {
    return false;
  }
}

TomlDocument::TomlDocument(std::string_view text, std::string file, FaultList& faults)
    : file_(std::move(file)), faults_(faults) {
  if (const auto line = text::LineNestedTooDeepInToml(text)) {
    faults_.Add({Fault::Severity::kFault, file_, *line, "", text::NestedTooDeepText()});
    return;
  }
  try {
    root_ = toml::parse(text, file_);
    parsed_ = true;
  } catch (const toml::parse_error& error) {
    const toml::source_position at = error.source().begin;
    TomlError found = ExplainTomlError(text, static_cast<int>(at.line), static_cast<int>(at.column),
                                       error.description());
    faults_.Add(
        {Fault::Severity::kFault, file_, found.line, "", std::move(found.what), found.column});
  }
}

TomlTable TomlDocument::Root() {
  return {*this, root_, ""};
}

std::vector<TomlDocument::MisplacedKey> TomlDocument::KeysOfTableAt(int header, int end) const {
  std::vector<MisplacedKey> keys;
  for (const auto& [table, known] : known_keys_) {
    if (static_cast<int>(table->source().begin.line) != header) continue;
    for (const auto& [key, node] : *table) {
      const auto line = static_cast<int>(key.source().begin.line);
      const bool is_known =
          std::find(known.keys.begin(), known.keys.end(), key.str()) != known.keys.end();
      if (is_known && line > header && line < end) {
        keys.push_back({line, std::string(key.str())});
      }
    }
  }
  return keys;
}

void TomlDocument::ReportMisplacedKeys(std::string_view text,
                                       const std::function<void(TomlDocument&)>& read) {
  constexpr int kMaxCopies = 64;  // bounds the time for an arbitrary text
  const std::vector<HeaderLine> headers = HeaderLines(text);
  int copies = 0;
  for (std::size_t k = 0; k < headers.size(); ++k) {
    const int end = k + 1 < headers.size() ? headers[k + 1].line : std::numeric_limits<int>::max();
    if (!headers[k].commented || !HasKeyBetween(root_, headers[k].line, end)) continue;
    if (++copies > kMaxCopies) break;
    FaultList ignored;
    TomlDocument copy(WithHeader(text, headers[k]), file_, ignored);
    if (!copy.parsed()) continue;
    read(copy);
    for (const MisplacedKey& key : copy.KeysOfTableAt(headers[k].line, end)) {
      faults_.RemoveLine(file_, key.line);
      misplaced_lines_.insert(key.line);
      faults_.Add({Fault::Severity::kFault, file_, key.line, key.key,
                   fmt::format("this key belongs to {0}, whose header in line {1} is commented "
                               "out; remove the # before {0}, or move this line above it",
                               headers[k].header, headers[k].line)});
    }
  }
}

void TomlDocument::ReportUnknownKeys(
    const std::function<std::vector<std::string>(std::string_view key)>& headers_with) {
  for (const auto& [table, known] : known_keys_) {
    for (const auto& [key, node] : *table) {
      if (std::find(known.keys.begin(), known.keys.end(), key.str()) != known.keys.end()) continue;
      const auto line = static_cast<int>(node.source().begin.line);
      if (misplaced_lines_.contains(static_cast<int>(key.source().begin.line))) continue;
      const std::string path =
          known.path.empty() ? std::string(key.str()) : fmt::format("{}.{}", known.path, key.str());
      const std::vector<std::string> headers =
          headers_with ? headers_with(key.str()) : std::vector<std::string>();
      const std::string nearest = text::NearestWord(key.str(), known.keys, 0.5);
      std::string hint;
      if (!headers.empty()) {
        hint = fmt::format(" here; it belongs to {0}: write it below the header {0}",
                           fmt::join(headers, " or "));
      } else if (!nearest.empty()) {
        hint = fmt::format("; did you mean \"{}\"?", nearest);
      }
      faults_.Add({Fault::Severity::kFault, file_, line, path, "unknown key" + hint});
    }
  }
}

}  // namespace plumbline::config
