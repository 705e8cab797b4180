#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "app/base/text/text_encoding.h"
#include "app/measure/imports/decimal_signs.h"
#include "app/measure/imports/import_table.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::measure {
namespace {

std::string DefaultUnit(ValueKind kind, const ImportOptions& options) {
  switch (kind) {
    case ValueKind::kLength:
      return options.length_unit;
    case ValueKind::kAngle:
      return options.angle_unit;
    case ValueKind::kTemperature:
      return options.temperature_unit;
    default:
      return "";
  }
}

const char* UnitOption(ValueKind kind) {
  return kind == ValueKind::kAngle         ? "--angle-unit"
         : kind == ValueKind::kTemperature ? "--temperature-unit"
                                           : "--length-unit";
}

/// "values from -0.42 to 0.93", for the person who must state the unit of the columns.
std::string ValuesText(const text::DelimitedText& layout, const std::vector<std::size_t>& columns) {
  double low = 1e300, high = -1e300;
  for (const text::Record& record : layout.records) {
    for (const std::size_t column : columns) {
      if (column >= record.fields.size()) continue;
      const auto value = text::NumberIn(record.fields[column], layout.decimal);
      if (value) low = std::min(low, *value), high = std::max(high, *value);
    }
  }
  return low > high ? "no values" : fmt::format("values from {:.6g} to {:.6g}", low, high);
}

std::string ColumnName(const text::DelimitedText& layout, std::size_t column) {
  const std::string& name = layout.names[column];
  return name.empty() ? std::to_string(column + 1) : fmt::format("\"{}\"", name);
}

/// Takes the unit of a column from the options if the file states none.
/// @return  false if the column then still has no unit
bool CompleteUnit(const UnderstoodFile& understood, std::size_t column,
                  const ImportOptions& options, ColumnMeaning& meaning, config::FaultList& faults) {
  const auto kind = KindOfTarget(meaning.target);
  if (!kind) return true;
  if (*kind == ValueKind::kText || *kind == ValueKind::kNumber) {
    meaning.unit.clear();
    return true;
  }
  if (meaning.unit.empty() && !DefaultUnit(*kind, options).empty()) {
    meaning.unit = DefaultUnit(*kind, options);
    meaning.because += fmt::format("; unit from {}", UnitOption(*kind));
  }
  if (ScaleOf(*kind, meaning.unit)) return true;
  if (meaning.unit.empty()) return false;
  faults.Add({config::Fault::Severity::kFault, understood.file, understood.layout.header_line,
              "column " + ColumnName(understood.layout, column),
              fmt::format("has the unit \"{}\", which is not known; map it; units: {}",
                          meaning.unit.substr(0, 40), UnitsOf(*kind))});
  return true;
}

/// Completes the units of all columns. One fault for all columns of a kind that have none.
void CompleteUnits(const ImportOptions& options, UnderstoodFile& file, config::FaultList& faults) {
  std::map<ValueKind, std::vector<std::size_t>> lacking;
  for (std::size_t i = 0; i < file.meanings.size(); ++i) {
    if (CompleteUnit(file, i, options, file.meanings[i], faults)) continue;
    lacking[*KindOfTarget(file.meanings[i].target)].push_back(i);
  }
  for (const auto& [kind, columns] : lacking) {
    std::string names;
    for (const std::size_t column : columns) {
      names += (names.empty() ? "" : ", ") + ColumnName(file.layout, column);
    }
    const bool one = columns.size() == 1;
    faults.Add({config::Fault::Severity::kFault, file.file, file.layout.header_line,
                fmt::format("column{} {}", one ? "" : "s", names),
                fmt::format("state{} no unit ({}); give {} or a mapping; units: {}", one ? "s" : "",
                            ValuesText(file.layout, columns), UnitOption(kind), UnitsOf(kind))});
  }
}

/// True if the first column counts the rows from 1.
bool CountsRows(const text::DelimitedText& layout) {
  double expected = 0;
  for (const text::Record& record : layout.records) {
    if (record.fields.empty() || text::NumberIn(record.fields[0], layout.decimal) != ++expected) {
      return false;
    }
  }
  return layout.records.size() > 1;
}

/// True if a column holds nothing but numbers without a decimal sign.
bool HoldsIntegers(const text::DelimitedText& layout, std::size_t column) {
  return std::ranges::all_of(layout.records, [&](const text::Record& record) {
    return column < record.fields.size() &&
           record.fields[column].find_first_of(".,eE") == std::string::npos &&
           text::NumberIn(record.fields[column], layout.decimal).has_value();
  });
}

/// How many decimals the fields with a decimal sign have. One count only: the writer keeps trailing
/// zeros, so that a joint at rest has decimals, too. Several: it drops them, and writes 90
/// for 90.0.
std::set<std::size_t> DecimalCounts(const text::DelimitedText& layout) {
  std::set<std::size_t> counts;
  for (const text::Record& record : layout.records) {
    for (const std::string& field : record.fields) {
      const std::size_t sign = field.find(layout.decimal);
      if (sign != std::string::npos) counts.insert(field.size() - sign);
    }
  }
  return counts;
}

bool HasDifferentFields(const text::DelimitedText& layout, std::size_t column) {
  std::set<std::string> fields;
  return std::ranges::all_of(layout.records, [&](const text::Record& record) {
    return column < record.fields.size() && fields.insert(record.fields[column]).second;
  });
}

/// True if the first column may number the rows: different integers from 0 on.
bool MayNumberRows(const text::DelimitedText& layout) {
  const auto negative = [&](const text::Record& record) {
    return text::NumberIn(record.fields[0], layout.decimal).value_or(0) < 0;
  };
  return layout.records.size() > 1 && HoldsIntegers(layout, 0) && HasDifferentFields(layout, 0) &&
         std::ranges::none_of(layout.records, negative);
}

/// True if no field of the first column is a number, and all differ.
bool NamesRows(const text::DelimitedText& layout) {
  const auto number = [&](const text::Record& record) {
    return record.fields[0].empty() || text::NumberIn(record.fields[0], layout.decimal).has_value();
  };
  return !layout.records.empty() && HasDifferentFields(layout, 0) &&
         std::ranges::none_of(layout.records, number);
}

/// True if every field is as a Keyence LK-G sends it over RS-232: a sign and a number in mm, or a
/// run of X or F without a value.
bool IsKeyence(const text::DelimitedText& layout) {
  const auto matches = [&](const text::Record& record) {
    if (record.fields.size() != 1) return false;
    const std::string& field = record.fields[0];
    if (field.find_first_not_of("+-XF.") == std::string::npos) return true;
    return field.find_first_of("+-") == 0 && text::NumberIn(field, layout.decimal).has_value();
  };
  return std::ranges::all_of(layout.records, matches);
}

/// Refuses columns without a name that would be taken for joints, but may be numbers or states.
void RefuseCounts(const UnderstoodFile& file, config::FaultList& faults) {
  const text::DelimitedText& layout = file.layout;
  const std::size_t kinds = DecimalCounts(layout).size();
  for (std::size_t i = 0; i < file.meanings.size(); ++i) {
    if (!file.meanings[i].target.starts_with("q") || !HoldsIntegers(layout, i)) continue;
    const bool number = i == 0 && kinds > 1 && MayNumberRows(layout);
    if (kinds != 1 && !number) continue;
    const text::Record& first = layout.records.front();
    faults.Add({config::Fault::Severity::kFault, file.file, first.line,
                fmt::format("column {}", i + 1),
                fmt::format("holds only integers ({}), the other columns do not: {}. Write a line "
                            "of names (q1_deg, ..), or map each column by its number",
                            first.fields[i].substr(0, 40),
                            number ? "it may number the rows, or be a joint in whole degrees"
                                   : "a number or state rather than a joint")});
  }
}

/// Meanings of columns without names, by their order.
void NameInOrder(const text::DelimitedText& layout, FileRole role, const std::string& length_unit,
                 std::vector<ColumnMeaning>& meanings) {
  if (role == FileRole::kMeasured && meanings.size() == 1) {
    meanings[0] = {"gauge_mm", "", "assumed: a single column, readings of a gauge"};
    if (length_unit.empty() && IsKeyence(layout)) {
      meanings[0] = {"gauge_mm", "mm", "a single column with signs: Keyence LK-G, in mm"};
    }
  }
  if (role == FileRole::kMeasured && meanings.size() == 3) {
    for (std::size_t i = 0; i < 3; ++i) {
      meanings[i] = {std::array{"x_mm", "y_mm", "z_mm"}[i], "", "assumed: three columns, no names"};
    }
  }
  if (role != FileRole::kJoints) return;
  const bool numbered =
      CountsRows(layout) || (MayNumberRows(layout) && DecimalCounts(layout).size() == 1);
  const bool named = meanings.size() > 1 && NamesRows(layout);
  const std::size_t first = numbered || named ? 1 : 0;
  if (meanings.size() - first > static_cast<std::size_t>(model::kMaxJoints)) return;
  if (numbered) meanings[0] = {"number", "", "assumed: numbers the rows"};
  if (named) meanings[0] = {"name", "", "assumed: names the rows"};
  for (std::size_t i = first; i < meanings.size(); ++i) {
    meanings[i] = {fmt::format("q{}_deg", i - first + 1), "", "assumed: joints in order, no names"};
  }
}

std::string PlaceOf(const text::DelimitedText& layout, std::size_t column) {
  const std::string& name = layout.names[column];
  return name.empty() ? fmt::format("column {}", column + 1)
                      : fmt::format("column {} \"{}\"", column + 1, name.substr(0, 40));
}

/// True if any line has different texts in two columns.
bool Differ(const text::DelimitedText& layout, std::size_t a, std::size_t b) {
  return std::ranges::any_of(layout.records, [&](const text::Record& record) {
    return std::max(a, b) < record.fields.size() && record.fields[a] != record.fields[b];
  });
}

/// Refuses a column that has the meaning of an earlier one and other values, unless a mapping chose
/// between them. Names, numbers and marks of points may be repeated.
void RefuseDuplicates(const UnderstoodFile& file, config::FaultList& faults) {
  constexpr std::array<std::string_view, 3> kMayRepeat = {"name", "number", "delete"};
  for (std::size_t i = 0; i < file.meanings.size(); ++i) {
    const ColumnMeaning& meaning = file.meanings[i];
    if (!meaning.same_as || meaning.because == "mapping") continue;
    const ColumnMeaning& first = file.meanings[*meaning.same_as];
    const bool decided = first.because == "mapping" || first.target.empty();
    const bool harmless = std::ranges::find(kMayRepeat, first.target) != kMayRepeat.end();
    if (decided || harmless || !Differ(file.layout, *meaning.same_as, i)) continue;
    faults.Add({config::Fault::Severity::kFault, file.file, file.layout.header_line,
                PlaceOf(file.layout, i),
                fmt::format("has the same meaning as {} ({}) and other values; state in a file "
                            "given as --mapping which one to use: to = \"{}\" for that one, to = "
                            "\"ignore\" for the other",
                            PlaceOf(file.layout, *meaning.same_as), first.target, first.target)});
  }
}

/// Columns of an export are a few dozen. Each field of each line takes memory of its own.
constexpr std::size_t kMaxSeparators = 1000;

/// The first line with more separators, from 1, and how many; nullopt if there is none.
std::optional<std::pair<int, std::size_t>> TooWideLine(std::string_view bytes) {
  std::size_t separators = 0;
  int line = 1;
  for (const char c : bytes) {
    if (c == '\n') {
      if (separators > kMaxSeparators) break;
      separators = 0;
      ++line;
    } else if (c == ',' || c == ';' || c == '\t' || c == ' ') {
      ++separators;
    }
  }
  if (separators <= kMaxSeparators) return std::nullopt;
  return std::pair(line, separators);
}

}  // namespace

UnderstoodFile Understand(std::string_view bytes, const std::string& file, FileRole role,
                          const Mapping& mapping, const std::string& mapping_file,
                          const ImportOptions& options, config::FaultList& faults) {
  if (const auto wide = TooWideLine(bytes)) {
    faults.Add({config::Fault::Severity::kFault, file, wide->first, "",
                fmt::format("has {} separators, but at most {} are read. Check that this is the "
                            "right file, and that rows and columns are not exchanged",
                            wide->second, kMaxSeparators)});
    UnderstoodFile refused;
    refused.file = file;
    refused.readable = false;
    return refused;
  }
  text::DecodedText decoded = text::DecodedFromBytes(bytes);
  text::LayoutHints hints = mapping.layout;
  if (!hints.decimal) hints.decimal = options.decimal;
  UnderstoodFile understood{file, decoded.encoding, text::LayoutOf(decoded.text, hints), {}, {},
                            true};
  if (understood.layout.decimal_assumed) {
    faults.Add({config::Fault::Severity::kFault, file, understood.layout.header_line, "",
                "the decimal sign is not clear: every comma is followed by three digits, so that "
                "1,234 may be 1.234 or 1234; give --decimal comma or --decimal point"});
  }
  understood.meanings = MeaningsWith(mapping, understood.layout, mapping_file, faults);
  std::vector<ColumnMeaning>& meanings = understood.meanings;
  if (understood.layout.header_line == 0 && mapping.columns.empty()) {
    NameInOrder(understood.layout, role, options.length_unit, meanings);
    RefuseCounts(understood, faults);
  }
  config::FaultList of_values;
  CompleteUnits(options, understood, of_values);
  understood.unclear_decimals = CheckDecimalSigns(understood, hints.decimal.has_value(), of_values);
  understood.readable = !of_values.HasFaults();
  faults.Append(of_values);
  RefuseDuplicates(understood, faults);
  return understood;
}

}  // namespace plumbline::measure
