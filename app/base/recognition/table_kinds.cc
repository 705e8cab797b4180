// Tables of numbers: measured points, readings of joints, exports of instruments.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "app/base/recognition/kinds.h"

namespace plumbline::recognition {
namespace {

/// The text as a table, if most of its fields are numbers; else nullptr.
const text::DelimitedText* TableOf(const Outline& file) {
  if (!file.table() || file.table()->records.empty()) return nullptr;
  const text::DelimitedText& table = *file.table();
  std::size_t numbers = 0, fields = 0, labels = 0;
  for (const text::Record& record : table.records) {
    for (const std::string& field : record.fields) {
      if (field.empty()) continue;
      ++fields;
      numbers += text::NumberIn(field, table.decimal) ? 1 : 0;
    }
    const std::string& first = record.fields.empty() ? std::string() : record.fields.front();
    const bool sign = record.fields.size() > 1 && record.fields[1] == "=";
    labels += sign || (!first.empty() && (first.back() == ':' || first.back() == '=')) ? 1 : 0;
  }
  const bool sentence =
      std::ranges::any_of(table.names, [](const std::string& name) { return name.ends_with(':'); });
  if (labels * 2 > table.records.size() || sentence) return nullptr;
  // Text with numbers in it has lines of any length.
  std::map<std::size_t, std::size_t> widths;
  for (const text::Record& record : table.records) ++widths[record.fields.size()];
  const auto commonest =
      std::ranges::max_element(widths, {}, [](const auto& width) { return width.second; });
  if (commonest->second * 2 <= table.records.size()) return nullptr;
  // A few words are no table.
  if (table.names.size() * table.records.size() < 3) return nullptr;
  const bool named = table.header_line > 0;
  const bool enough = named ? numbers * 3 >= fields : numbers * 10 >= fields * 6;
  return numbers > 0 && enough ? &table : nullptr;
}

std::size_t NumbersIn(const text::Record& record, char decimal) {
  return static_cast<std::size_t>(std::ranges::count_if(
      record.fields,
      [decimal](const std::string& field) { return text::NumberIn(field, decimal).has_value(); }));
}

bool HasName(const text::DelimitedText& table, std::string_view name) {
  return std::ranges::find(table.names, name) != table.names.end();
}

/// The first column whose name, in lower case, holds a part.
const std::string* NameWith(const text::DelimitedText& table, std::string_view part) {
  for (const std::string& name : table.names) {
    if (InLowerCase(name).find(part) != std::string::npos) return &name;
  }
  return nullptr;
}

std::optional<Fact> HeaderFact(const text::DelimitedText& table, std::string_view name) {
  return Fact{"", fmt::format("column {}", Quoted(name)), table.header_line};
}

/// A table one of whose columns has this name.
std::optional<Fact> Named(const Outline& file, std::initializer_list<std::string_view> parts) {
  const text::DelimitedText* const table = TableOf(file);
  if (table == nullptr) return std::nullopt;
  for (const std::string_view part : parts) {
    if (const std::string* const name = NameWith(*table, part)) return HeaderFact(*table, *name);
  }
  return std::nullopt;
}

constexpr std::size_t kLongestNames = 160;

std::string SeparatorWord(char separator) {
  return separator == ';'    ? "semicolon"
         : separator == '\t' ? "tab"
         : separator == ' '  ? "blanks"
                             : "comma";
}

/// Lines that are not empty, from the first record on.
std::size_t RowCount(const Outline& file, const text::DelimitedText& table) {
  if (file.text().size() <= Outline::kTableBytes) return table.records.size();
  std::size_t rows = 0;
  int number = 1;
  bool blank = true;
  for (const char c : file.text()) {
    if (c != '\n') {
      blank = blank && (c == ' ' || c == '\t' || c == '\r');
      continue;
    }
    rows += !blank && number >= table.records.front().line ? 1 : 0;
    blank = true;
    ++number;
  }
  return rows + (blank ? 0 : 1);
}

void ReadTable(const Outline& file, Recognition& found) {
  const text::DelimitedText* const table = TableOf(file);
  if (table == nullptr) return;
  AddFact(found, "layout",
          fmt::format("{}, decimal {}", SeparatorWord(table->separator),
                      table->decimal == ',' ? "comma" : "point"),
          table->records.front().line);
  AddFact(found, "rows", fmt::format("{}", RowCount(file, *table)), table->records.front().line);
  if (table->header_line > 0) {
    AddFact(found, "columns",
            fmt::format("{}: {}", table->names.size(),
                        Quoted(fmt::format("{}", fmt::join(table->names, ", ")), kLongestNames)),
            table->header_line);
  } else {
    AddFact(found, "columns", fmt::format("{}, without names", table->names.size()));
  }
  std::string units;
  for (std::size_t k = 0; k < table->names.size(); ++k) {
    const std::string& name = table->names[k];
    const std::size_t open = name.find_last_of("[(");
    if (open == std::string::npos || !(name.back() == ']' || name.back() == ')')) continue;
    const std::string unit = name.substr(open);
    if (units.find(unit) == std::string::npos) units += (units.empty() ? "" : " ") + unit;
  }
  if (!units.empty()) AddFact(found, "units", Quoted(units), table->header_line);
  if (table->decimal_assumed) {
    found.undecided.emplace_back(
        "the decimal sign: every comma is followed by three digits; give --decimal");
  }
  CheckTable(file, *table, found);
}

/// Whether every row holds the whole number before plus 1: names of points, no quantity.
bool IsCount(const text::DelimitedText& table, std::size_t column) {
  std::optional<double> last;
  for (const text::Record& record : table.records) {
    const auto value = column < record.fields.size()
                           ? text::NumberIn(record.fields[column], table.decimal)
                           : std::nullopt;
    if (!value || *value != std::round(*value) || (last && *value != *last + 1)) return false;
    last = value;
  }
  return table.records.size() > 1;
}

/// Tables of others: columns of numbers whose names state no unit.
void ReadForeign(const Outline& file, Recognition& found) {
  ReadTable(file, found);
  const text::DelimitedText* const table = TableOf(file);
  if (table == nullptr || table->header_line == 0) return;
  constexpr std::array<std::string_view, 4> kUnits = {"mm", "inch", "deg", "rad"};
  for (const std::string& line : table->preamble) {
    for (const std::string_view unit : kUnits) {
      if (InLowerCase(line).find(unit) != std::string::npos) return;
    }
  }
  std::vector<std::string> open;
  for (std::size_t k = 0; k < table->names.size(); ++k) {
    const auto& fields = table->records.front().fields;
    const bool number = k < fields.size() && text::NumberIn(fields[k], table->decimal);
    const bool stated =
        StatesUnit(table->names[k]) || (k < table->units.size() && !table->units[k].empty());
    const std::string name = InLowerCase(table->names[k]);
    const bool quaternion = name == "qw" || name == "qx" || name == "qy" || name == "qz";
    if (number && !stated && !quaternion && !IsCount(*table, k)) open.push_back(table->names[k]);
  }
  if (open.empty()) return;
  found.undecided.push_back(
      fmt::format("the units of {}: such as mm or m, deg or rad",
                  Quoted(fmt::format("{}", fmt::join(open, ", ")), kLongestNames)));
}

/// What contradicts a table of this product, whose names state the units.
void CheckOwn(const text::DelimitedText& table, Recognition& found) {
  std::vector<std::size_t> degrees, places, rotation;
  for (std::size_t k = 0; k < table.names.size(); ++k) {
    const std::string& name = table.names[k];
    if (name.starts_with("q") && name.ends_with("_deg")) degrees.push_back(k);
    if (name == "x_mm" || name == "y_mm" || name == "z_mm") places.push_back(k);
  }
  for (const char* const name : {"qw", "qx", "qy", "qz"}) {
    const auto at = std::ranges::find(table.names, name);
    if (at != table.names.end())
      rotation.push_back(static_cast<std::size_t>(at - table.names.begin()));
  }
  CheckDegrees(table, degrees, found);
  if (!places.empty() && places.size() < 3) {
    std::vector<std::string> there;
    for (const std::size_t place : places) there.push_back(table.names[place]);
    Contradict(
        found, "columns",
        fmt::format("only {} of x_mm, y_mm, z_mm: a point has all three", fmt::join(there, ", ")),
        table.header_line);
  }
  const auto numbers = [&](const text::Record& record, const std::vector<std::size_t>& columns) {
    std::vector<double> all;
    for (const std::size_t k : columns) {
      const auto value =
          k < record.fields.size() ? text::NumberIn(record.fields[k], table.decimal) : std::nullopt;
      if (value) all.push_back(*value);
    }
    return all;
  };
  double largest = 0;
  bool fractions = false;
  for (const text::Record& record : table.records) {
    for (const double value : numbers(record, places)) {
      largest = std::max(largest, std::abs(value));
      fractions = fractions || value != std::round(value);
    }
    const bool known = std::ranges::find(found.contradictions, "rotation", &Fact::what) !=
                       found.contradictions.end();
    if (rotation.size() == 4 && !known) {
      CheckQuaternion(numbers(record, rotation), record.line, found);
    }
  }
  constexpr double kReach_m = 5;  // of large arms
  if (places.size() == 3 && fractions && table.records.size() > 1 && largest > 0.1 &&
      largest < kReach_m) {
    Contradict(found, "units",
               fmt::format("x_mm, y_mm, z_mm look like m: the largest number is {:g}; multiply "
                           "them by 1000 if so",
                           largest),
               table.header_line);
  }
}

/// Tables of this product name their units.
void ReadMeasured(const Outline& file, Recognition& found) {
  ReadTable(file, found);
  const text::DelimitedText& table = *file.table();
  CheckOwn(table, found);
  std::size_t joints = 0;
  while (HasName(table, fmt::format("q{}_deg", joints + 1)) ||
         HasName(table, fmt::format("q{}_mm", joints + 1))) {
    ++joints;
  }
  AddFact(found, "joints", fmt::format("{}", joints), table.header_line);
  const bool measured =
      HasName(table, "x_mm") || HasName(table, "range_mm") || HasName(table, "artefact");
  if (!measured) {
    found.name = "a table of postures (test_poses.csv)";
    found.command = "plumbline predict CELL.toml {} --out predicted.csv";
  }
}

void ReadRtde(const Outline& file, Recognition& found) {
  ReadTable(file, found);
  AddFact(found, "units", "rad, m (RTDE)");
  if (NameWith(*file.table(), "actual_tcp_pose") != nullptr) {
    AddFact(found, "actual_TCP_pose", "computed by the controller: no measurement",
            file.table()->header_line);
  }
}

void ReadCmm(const Outline& file, Recognition& found) {
  ReadForeign(file, found);
  if (NameWith(*file.table(), "nominal") != nullptr) {
    AddFact(found, "nominal values", "are not measurements; import ignores them",
            file.table()->header_line);
  }
}

/// Without names, the number of columns leaves several meanings.
void ReadBare(const Outline& file, Recognition& found) {
  ReadTable(file, found);
  const std::size_t width = file.table()->names.size();
  found.certainty = Certainty::kUndecided;
  const Line* names = nullptr;
  for (const Line& line : file.head()) {
    if (line.number < file.table()->records.front().line) names = &line;
  }
  if (names != nullptr && !names->text.starts_with("#") && width > 2) {
    const text::LayoutHints hints{file.table()->separator, file.table()->decimal, 0};
    const text::DelimitedText header = text::LayoutOf(names->text, hints);
    const std::size_t named = header.records.empty() ? 0 : header.records.front().fields.size();
    if (named > 1 && named != width && NumbersIn(header.records.front(), header.decimal) == 0) {
      const bool commas = header.separator == ',' && (width == 2 * named || width == 2 * named - 1);
      Contradict(found, "columns",
                 fmt::format("{} names, but {} fields in line {}{}", named, width,
                             file.table()->records.front().line,
                             commas ? ": commas separate the fields and look like decimal commas, "
                                      "too; export it with semicolons or decimal points"
                                    : ": names or numbers are missing"),
                 names->number);
      found.undecided.emplace_back("which field belongs to which name, and the units");
      return;
    }
  }
  if (width == 1) {
    found.candidates = {"readings of a gauge", "one coordinate"};
  } else if (width == 3) {
    found.candidates = {"points x, y, z", "three joints"};
  } else if (width == 6) {
    found.candidates = {"six joints", "poses: x, y, z and three angles"};
  } else if (width == 7) {
    found.candidates = {"seven joints", "poses: x, y, z and a quaternion",
                        "a number and six joints"};
  }
  found.undecided.emplace_back("what the columns mean, and their units: the file has no names");
}

constexpr const char *kImport = "plumbline import {} --preview",
                     *kJoints = "plumbline import POINTS.csv --joints {} --preview";

constexpr std::array kTableKinds = {
    Kind{
        "robot-poses", "a table of robot poses, one per image", Content::kPoses,
        [](const Outline& file) -> std::optional<Fact> {
          const text::DelimitedText* const table = TableOf(file);
          if (table == nullptr || !HasName(*table, "image") || table->separator != ',' ||
              !(HasName(*table, "x_mm") || HasName(*table, "q1_deg") || HasName(*table, "q1_mm"))) {
            return std::nullopt;
          }
          return HeaderFact(*table, "image");
        },
        [](const Outline& file, Recognition& found) {
          ReadTable(file, found);
          CheckOwn(*file.table(), found);
        },
        "plumbline calibrate-hand-eye --images FOLDER --poses {} --intrinsics LENS.json", ""},
    Kind{"measured", "a table of measured points (measured.csv)", Content::kMeasured,
         [](const Outline& file) -> std::optional<Fact> {
           const text::DelimitedText* const table = TableOf(file);
           if (table == nullptr || table->separator != ',') return std::nullopt;
           for (const char* const name : {"q1_deg", "q1_mm"}) {
             if (HasName(*table, name)) return HeaderFact(*table, name);
           }
           return std::nullopt;
         },
         ReadMeasured, "plumbline diagnose CELL.toml {}", ""},
    Kind{"rtde", "a recording of a UR's controller (RTDE)", Content::kExport,
         [](const Outline& file) {
           return Named(file, {"actual_q_0", "target_q_0", "actual_tcp_pose_0"});
         },
         ReadRtde, kJoints, ""},
    Kind{
        "ros-csv", "a topic of ROS as a table (rostopic echo -p, PlotJuggler)", Content::kExport,
        [](const Outline& file) {
          return Named(file, {"%time", "field.header.", "header.stamp", "__time", "/joint_states"});
        },
        [](const Outline& file, Recognition& found) {
          ReadTable(file, found);
          AddFact(found, "units", "rad, m (ROS)");
        },
        kJoints, ""},
    Kind{"tracker", "an export of a laser tracker (Leica)", Content::kExport,
         [](const Outline& file) {
           return Named(file, {"u(95)", "otg applied", "image rms"});
         },
         ReadForeign, kImport, ""},
    Kind{"spatial-analyzer", "an export of SpatialAnalyzer", Content::kExport,
         [](const Outline& file) -> std::optional<Fact> {
           if (TableOf(file) == nullptr) return std::nullopt;
           for (const Line& line : file.head()) {
             if (line.text.find("SpatialAnalyzer") != std::string_view::npos) return Shown(&line);
           }
           return std::nullopt;
         },
         [](const Outline& file, Recognition& found) {
           ReadTable(file, found);
           found.undecided.emplace_back("order and unit, which are chosen when it is exported");
         },
         kImport, ""},
    Kind{"cmm", "a report of a coordinate measuring machine", Content::kExport,
         [](const Outline& file) {
           return Named(
               file, {"element name", "nominal", "mx coord", "sollwert", "istwert", "out of tol"});
         },
         ReadCmm, kImport, ""},
    Kind{"table", "a table of numbers", Content::kTable,
         [](const Outline& file) -> std::optional<Fact> {
           const text::DelimitedText* const table = TableOf(file);
           if (table == nullptr || table->header_line == 0) return std::nullopt;
           return Fact{"", Quoted(fmt::format("{}", fmt::join(table->names, ", "))),
                       table->header_line};
         },
         ReadForeign, kImport, ""},
    Kind{"bare-table", "a table of numbers without names", Content::kTable,
         [](const Outline& file) -> std::optional<Fact> {
           const text::DelimitedText* const table = TableOf(file);
           if (table == nullptr) return std::nullopt;
           return Fact{"", Quoted(fmt::format("{}", fmt::join(table->records.front().fields, " "))),
                       table->records.front().line};
         },
         ReadBare, kImport, ""},
};

}  // namespace

bool StatesUnit(std::string_view name) {
  if (name.ends_with(']') || name.ends_with(')')) return name.find_first_of("[(") < name.size();
  constexpr std::array<std::string_view, 22> kUnits = {
      "mm", "m",  "cm", "um", "\u00b5m", "in", "inch", "deg", "\u00b0", "rad", "mrad",
      "s",  "ms", "us", "ns", "kg",      "nm", "n",    "hz",  "c",      "%",   "degc"};
  const auto sign = name.find_last_of("_ /");
  return sign != std::string_view::npos &&
         std::ranges::find(kUnits, InLowerCase(name.substr(sign + 1))) != kUnits.end();
}

void CheckDegrees(const text::DelimitedText& table, const std::vector<std::size_t>& columns,
                  Recognition& found) {
  constexpr std::size_t kLeastDigits = 2;
  const text::Record* shown = nullptr;
  std::string example;
  for (const text::Record& record : table.records) {
    for (const std::size_t k : columns) {
      const auto value =
          k < record.fields.size() ? text::NumberIn(record.fields[k], table.decimal) : std::nullopt;
      if (!value) continue;
      const double size = std::abs(*value);
      if (size > 2 * std::numbers::pi) return;
      const std::size_t point = record.fields[k].find(table.decimal);
      const std::size_t digits =
          point == std::string::npos ? 0 : record.fields[k].size() - point - 1;
      const double last = 0.51 * std::pow(10.0, -static_cast<double>(digits));
      const bool pi = std::abs(size - std::numbers::pi) <= last ||
                      std::abs(size - std::numbers::pi / 2) <= last;
      if (shown != nullptr || digits < kLeastDigits || !pi) continue;
      shown = &record;
      example = record.fields[k];
    }
  }
  if (shown == nullptr) return;
  Contradict(found, "units",
             fmt::format("the angles are named as deg, but look like rad: {} is a part of pi, and "
                         "none is larger than 2 pi; convert them, or correct the name",
                         Quoted(example)),
             shown->line);
}

void CheckQuaternion(const std::vector<double>& numbers, int line, Recognition& found) {
  constexpr double kRounding = 0.01;
  if (numbers.size() != 4) return;
  const double length =
      std::hypot(std::hypot(numbers[0], numbers[1]), std::hypot(numbers[2], numbers[3]));
  if (std::abs(length - 1) <= kRounding) return;
  Contradict(found, "rotation",
             fmt::format("the quaternion {:g} has the length {:.3g}, not 1: it is no rotation",
                         fmt::join(numbers, ", "), length),
             line);
}

void CheckTable(const Outline& file, const text::DelimitedText& table, Recognition& found) {
  const std::size_t width = table.names.size();
  std::size_t odd = 0;
  const text::Record* first = nullptr;
  for (const text::Record& record : table.records) {
    // A separator at the end of a line is not counted.
    if (record.fields.size() == width || record.fields.size() + 1 == width) continue;
    ++odd;
    if (first == nullptr) first = &record;
  }
  if (first != nullptr) {
    const bool last =
        first == &table.records.back() && odd == 1 && file.text().size() <= Outline::kTableBytes;
    Contradict(found, "columns",
               fmt::format("{} fields, but {} columns{}", first->fields.size(), width,
                           last      ? ": the last line is cut"
                           : odd > 1 ? fmt::format("; {} lines are so", odd)
                                     : ""),
               first->line);
  }
  std::size_t before = 0;
  for (const std::string& line : table.preamble) {
    const text::DelimitedText one = text::LayoutOf(line, {});
    const bool data = one.names.size() > 2 && one.records.size() == 1 && one.header_line == 0;
    before += data && 2 * NumbersIn(one.records.front(), one.decimal) >= one.names.size() ? 1 : 0;
  }
  if (before > 2 && table.header_line > 0) {
    Contradict(found, "columns",
               fmt::format("{} lines of numbers stand before the names: two tables in one", before),
               table.header_line);
  }
  for (const text::Record& record : table.records) {
    const auto filled = std::ranges::count_if(
        record.fields, [](const std::string& field) { return !field.empty(); });
    const bool words = width > 1 && filled > 1 &&
                       2 * filled >= static_cast<std::ptrdiff_t>(width) &&
                       NumbersIn(record, table.decimal) == 0;
    if (!words || record.fields == table.names) continue;
    Contradict(found, "columns", "a line of words among the numbers: names of a second table?",
               record.line);
    break;
  }
  std::set<std::string> names;
  for (const std::string& name : table.names) {
    if (name.empty() || names.insert(name).second) continue;
    Contradict(found, "columns", fmt::format("{} is the name of two columns", Quoted(name)),
               table.header_line);
    break;
  }
  for (const text::Record& record : table.records) {
    const bool repeats = table.header_line > 0 && width > 1 && record.fields.size() == width &&
                         record.fields == table.names;
    if (!repeats) continue;
    Contradict(found, "columns", "the names come again: two files in one", record.line);
    break;
  }
}

std::span<const Kind> TableKinds() {
  return kTableKinds;
}

}  // namespace plumbline::recognition
