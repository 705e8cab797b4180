#include "app/measure/imports/mapping.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/base/config/toml_reader.h"
#include "app/base/text/json_text.h"

namespace plumbline::measure {
namespace {

const std::string kIgnored = "ignore";

void ReadColumn(const config::TomlTable& table, std::vector<MappedColumn>& columns) {
  MappedColumn column;
  if (const auto number = table.Integer("number", 1, 1000000)) {
    column.number = *number;
    if (table.Has("from")) table.AddFault("number", "is given beside from; keep one of them");
  } else {
    column.from = table.RequiredString("from").value_or("");
  }
  column.to = table.RequiredString("to").value_or("");
  if (column.to == kIgnored) column.to.clear();
  column.unit = table.String("unit").value_or("");
  const auto kind = KindOfTarget(column.to);
  if (!column.to.empty() && !kind) {
    table.AddFault(
        "to",
        "is neither a column of measured.csv nor number, name, delete, u95_mm, u95_x_mm, "
        "u95_y_mm, u95_z_mm");
  } else if (kind && !column.unit.empty() && !ScaleOf(*kind, column.unit)) {
    table.AddFault("unit", fmt::format("\"{}\" is not a unit of {}; allowed: {}",
                                       column.unit.substr(0, 60), column.to, UnitsOf(*kind)));
  }
  columns.push_back(std::move(column));
}

/// As a basic string of TOML, whose escapes are those of JSON; it also forbids the character DEL.
std::string Quoted(const std::string& text) {
  std::string quoted = text::JsonText(nlohmann::json(text));
  for (auto at = quoted.find('\x7f'); at != std::string::npos; at = quoted.find('\x7f')) {
    quoted.replace(at, 1, "\\u007F");
  }
  return quoted;
}

}  // namespace

std::optional<Mapping> MappingFromText(std::string_view text, const std::string& file,
                                       config::FaultList& faults) {
  return config::ReadDocument(text, file, faults, [](config::TomlDocument& document) {
    Mapping mapping;
    const config::TomlTable root = document.Root();
    root.RequiredInteger("schema", 1, 1);
    mapping.layout.separator = root.OneOf<char>(
        "separator", {{"comma", ','}, {"semicolon", ';'}, {"tab", '\t'}, {"blanks", ' '}});
    mapping.layout.decimal = root.OneOf<char>("decimal", {{"comma", ','}, {"point", '.'}});
    mapping.layout.header_line = root.Integer("header_line", 0, 1000);
    for (const config::TomlTable& table : root.Tables("column")) ReadColumn(table, mapping.columns);
    return mapping;
  });
}

std::string TextOfMapping(const Mapping& mapping) {
  std::string text = "# How `plumbline import` reads files of this kind.\nschema = 1\n";
  if (const auto separator = mapping.layout.separator) {
    text += fmt::format("separator = \"{}\"\n", *separator == ','   ? "comma"
                                                : *separator == ';' ? "semicolon"
                                                : *separator == ' ' ? "blanks"
                                                                    : "tab");
  }
  if (const auto decimal = mapping.layout.decimal) {
    text += fmt::format("decimal = \"{}\"\n", *decimal == ',' ? "comma" : "point");
  }
  if (mapping.layout.header_line) {
    text += fmt::format("header_line = {}\n", *mapping.layout.header_line);
  }
  for (const MappedColumn& column : mapping.columns) {
    text += "\n[[column]]\n";
    text += column.from.empty() ? fmt::format("number = {}\n", column.number)
                                : fmt::format("from = {}\n", Quoted(column.from));
    text += fmt::format("to = {}\n", Quoted(column.to.empty() ? kIgnored : column.to));
    if (!column.unit.empty()) text += fmt::format("unit = {}\n", Quoted(column.unit));
  }
  return text;
}

namespace {

/// Index of the column that an entry refers to; nullopt after a fault.
std::optional<std::size_t> ColumnOf(const MappedColumn& column,
                                    const std::vector<std::string>& names,
                                    const std::string& mapping_file, config::FaultList& faults) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const bool numbered = static_cast<std::size_t>(column.number) == i + 1;
    if (column.from.empty() ? numbered : names[i] == column.from) found.push_back(i);
  }
  if (found.size() == 1) return found.front();
  const std::string entry =
      column.from.empty() ? fmt::format("number {}", column.number) : "\"" + column.from + "\"";
  faults.Add(
      {config::Fault::Severity::kFault, mapping_file, 0, "column",
       found.empty()
           ? fmt::format("{} is not a column of the file, which has {}; correct or remove it",
                         entry, names.size())
           : fmt::format("{} is the name of {} columns; replace from by number = {} or {}", entry,
                         found.size(), found[0] + 1, found[1] + 1)});
  return std::nullopt;
}

}  // namespace

std::vector<ColumnMeaning> MeaningsWith(const Mapping& mapping, const text::DelimitedText& layout,
                                        const std::string& mapping_file,
                                        config::FaultList& faults) {
  std::vector<ColumnMeaning> meanings = MeaningsOf(layout.names, layout.units);
  for (const MappedColumn& column : mapping.columns) {
    const auto at = ColumnOf(column, layout.names, mapping_file, faults);
    if (!at) continue;
    // The person's choice outranks another column of the same meaning.
    for (ColumnMeaning& other : meanings) {
      if (!column.to.empty() && other.target == column.to) other.target.clear();
    }
    meanings[*at].target = column.to;
    if (!column.unit.empty()) meanings[*at].unit = column.unit;
    meanings[*at].because = "mapping";
  }
  return meanings;
}

}  // namespace plumbline::measure
