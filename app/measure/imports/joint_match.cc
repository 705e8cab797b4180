// Joints of a second file, matched with the measured rows.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "app/measure/imports/import_table.h"
#include "app/measure/imports/row_order.h"

namespace plumbline::measure {
namespace {

std::string Key(const ImportedRow& row, const char* column) {
  const auto text = row.texts.find(column);
  if (text == row.texts.end()) return "";
  const auto number = text::NumberIn(text->second, '.');
  return number && *number == std::round(*number) ? fmt::format("{:.0f}", *number) : text->second;
}

bool AnyHas(const ImportedTable& table, const char* column) {
  return std::ranges::any_of(table.rows,
                             [&](const ImportedRow& row) { return !Key(row, column).empty(); });
}

void AddJoints(const ImportedRow& joints, ImportedRow& row) {
  for (const auto& [name, value] : joints.numbers) row.numbers.emplace(name, value);
  for (const auto& [name, value] : joints.texts) row.texts.emplace(name, value);
}

/// A fault for each key that two lines of the joints have.
void CheckKeysUnique(const ImportedTable& joints, const char* column, const std::string& file,
                     config::FaultList& faults) {
  std::map<std::string, int> lines;
  for (const ImportedRow& posture : joints.rows) {
    const std::string key = Key(posture, column);
    if (key.empty()) continue;
    const auto [first, added] = lines.emplace(key, posture.line);
    if (added) continue;
    faults.Add({config::Fault::Severity::kFault, file, posture.line, column,
                fmt::format("\"{}\" is also in line {}, so the measured row cannot be matched; "
                            "remove one of the lines, or map the column to \"ignore\"",
                            key.substr(0, 40), first->second)});
  }
}

/// A fault if most measured rows have a key that the joints lack: the files count differently, and
/// the few keys in common then belong to different rows.
void CheckKeysCommon(const ImportedTable& measured, const ImportedTable& joints, const char* column,
                     const std::string& file, config::FaultList& faults) {
  std::set<std::string> known;
  for (const ImportedRow& posture : joints.rows) known.insert(Key(posture, column));
  std::size_t common = 0, keyed = 0;
  std::string missing;
  for (const ImportedRow& row : measured.rows) {
    const std::string key = Key(row, column);
    if (key.empty()) continue;
    ++keyed;
    common += known.contains(key) ? 1 : 0;
    if (missing.empty() && !known.contains(key)) missing = key;
  }
  if (2 * common >= keyed) return;
  faults.Add({config::Fault::Severity::kFault, file, 0, column,
              fmt::format("has only {} of the {} measured rows (not \"{}\"): both files number or "
                          "name their rows, but not alike. Correct one of the columns, or map it "
                          "to \"ignore\" if the rows of both files are in the same order",
                          common, keyed, missing.substr(0, 40))});
}

/// Postures in the order of the joints' file, each followed by its further measurements.
ImportedTable MatchedByKey(const ImportedTable& measured, const ImportedTable& joints,
                           const char* column) {
  ImportedTable matched = measured;
  matched.rows.clear();
  std::map<std::string, std::vector<const ImportedRow*>> by_key;
  for (const ImportedRow& row : measured.rows) by_key[Key(row, column)].push_back(&row);
  for (const ImportedRow& posture : joints.rows) {
    const std::string key = Key(posture, column);
    const auto found = key.empty() ? by_key.end() : by_key.find(key);
    if (found == by_key.end()) {
      matched.rows.push_back(posture);
      continue;
    }
    for (const ImportedRow* row : found->second) {
      matched.rows.push_back(*row);
      AddJoints(posture, matched.rows.back());
    }
    by_key.erase(found);
  }
  for (const auto& [key, rows] : by_key) {
    const std::string reason =
        key.empty() ? fmt::format("has no {}, by which the other rows are matched", column)
                    : fmt::format("{} {} is not in the file of the joints", column, key);
    for (const ImportedRow* row : rows) matched.rejected.push_back({row->line, reason, row->file});
  }
  matched.notes.push_back(fmt::format("joints matched by {}", column));
  return matched;
}

bool HasTimes(const ImportedTable& table) {
  return std::ranges::any_of(table.rows,
                             [](const ImportedRow& row) { return row.numbers.contains("t_s"); });
}

void ShiftTimes(ImportedTable& table, double origin_s) {
  for (ImportedRow& row : table.rows) {
    const auto t_s = row.numbers.find("t_s");
    if (t_s != row.numbers.end()) t_s->second += *table.first_stamp_s - origin_s;
  }
  table.first_stamp_s = origin_s;
}

/// Gives t_s of both files one origin, or leaves that of the joints out.
void AlignTimes(ImportedTable& measured, ImportedTable& joints, const std::string& joints_file) {
  if (!HasTimes(measured) || !HasTimes(joints)) return;
  if (measured.first_stamp_s && joints.first_stamp_s) {
    const double origin_s = std::min(*measured.first_stamp_s, *joints.first_stamp_s);
    ShiftTimes(measured, origin_s);
    ShiftTimes(joints, origin_s);
    return;
  }
  for (ImportedRow& row : joints.rows) row.numbers.erase("t_s");
  measured.notes.push_back(fmt::format(
      "t_s of {} is left out: without dates in both files its origin is not known", joints_file));
}

bool IsJoint(const std::string& column) {
  return column.size() > 2 && column[0] == 'q' && column[1] >= '0' && column[1] <= '9';
}

}  // namespace

ImportedTable WithJoints(ImportedTable measured, ImportedTable joints,
                         const std::string& joints_file, config::FaultList& faults) {
  const ImportedTable joints_as_read = joints;
  AlignTimes(measured, joints, joints_file);
  ImportedTable matched = measured;
  const auto complete = [&] {
    matched.rejected.insert(matched.rejected.end(), joints.rejected.begin(), joints.rejected.end());
    matched.notes.insert(matched.notes.end(), joints.notes.begin(), joints.notes.end());
    return matched;
  };
  for (const char* column : {"number", "name"}) {
    if (!AnyHas(measured, column) || !AnyHas(joints, column)) continue;
    CheckKeysUnique(joints, column, joints_file, faults);
    CheckKeysCommon(measured, joints, column, joints_file, faults);
    matched = MatchedByKey(measured, joints, column);
    return complete();
  }
  if (AnyHas(joints, "name")) {
    faults.Add({config::Fault::Severity::kFault, joints_file, 0, "name",
                "names its rows, but no column of the measurements is known to hold these names; "
                "map that column to \"name\", or this one to \"ignore\" if the rows of both files "
                "are in the same order"});
    return matched;
  }
  if (measured.rows.size() != joints.rows.size()) {
    faults.Add({config::Fault::Severity::kFault, joints_file, 0, "",
                fmt::format("has {} rows, but {} were measured, and no column numbers the rows of "
                            "both files; number them, or remove the lines without a counterpart",
                            joints.rows.size(), measured.rows.size())});
    return matched;
  }
  const auto pairing = PairingOf(measured, joints_as_read, joints_file, faults);
  if (!pairing) return matched;
  for (std::size_t i = 0; i < matched.rows.size(); ++i) {
    AddJoints(joints.rows[pairing->joints_row[i]], matched.rows[i]);
  }
  matched.notes.push_back("joints matched by " + pairing->evidence);
  return complete();
}

void RejectRowsWithoutJoints(ImportedTable& table) {
  std::set<std::string> required;
  for (const ImportedRow& row : table.rows) {
    for (const auto& [name, value] : row.numbers) {
      if (IsJoint(name)) required.insert(name);
    }
  }
  std::set<std::pair<std::string, int>> named;
  for (const RejectedLine& line : table.rejected) named.emplace(line.file, line.line);
  std::vector<ImportedRow> kept;
  for (ImportedRow& row : table.rows) {
    const auto missing = std::ranges::find_if(
        required, [&](const auto& name) { return !row.numbers.contains(name); });
    if (!required.empty() && missing == required.end()) {
      kept.push_back(std::move(row));
    } else if (named.emplace(row.file, row.line).second) {
      table.rejected.push_back(
          {row.line,
           row.HasJoints() && missing != required.end()
               ? fmt::format("has no value of {}; the row is left out", *missing)
               : "has no joints; the row is left out",
           row.file});
    }
  }
  table.rows = std::move(kept);
}

}  // namespace plumbline::measure
