#include "app/cli/diagnose_input.h"

#include <fmt/format.h>

#include <map>
#include <optional>

#include "app/base/config/cell_reader.h"
#include "app/base/text/sha256.h"
#include "app/measure/siblings/repeated_rows.h"
#include "app/measure/siblings/sibling_folder.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/text_file.h"

namespace plumbline::cli {
namespace {

/// Error if many rows of a sibling are also rows of the arm or of an earlier sibling.
Result<void> CheckRepeatedRows(const DiagnoseArguments& arguments, const DiagnoseInput& input,
                               const std::vector<measure::Arm>& earlier,
                               const measure::Arm& sibling) {
  const auto check = [&](const std::string& owner,
                         const measure::MeasuredTable& rows) -> Result<void> {
    const std::size_t repeated = measure::RepeatedRows(rows, sibling.rows, input.cell.robot.joints);
    if (!measure::IsRepeated(repeated, rows.rows.size(), sibling.rows.rows.size())) return {};
    return Error{fmt::format(
        "{}: {} of its {} rows are also rows of {} (same joints, same readings): a copy is not "
        "another arm, and would count twice; leave the folder out, or measure that arm",
        sibling.name, repeated, sibling.rows.rows.size(), owner)};
  };
  if (const Result<void> own = check(arguments.measured, input.measured); !own) return own;
  for (const measure::Arm& arm : earlier) {
    if (const Result<void> other = check(arm.name, arm.rows); !other) return other;
  }
  return {};
}

/// Reads the siblings; each must be another arm, declared like this one.
Result<std::vector<measure::Arm>> ReadSiblings(const DiagnoseArguments& arguments,
                                               const DiagnoseInput& input, std::ostream& err) {
  std::vector<measure::Arm> arms;
  std::map<std::string, std::string> owner_of_rows = {{input.data_sha256, arguments.measured}};
  for (const std::string& folder : arguments.siblings) {
    config::FaultList faults;
    Result<measure::Arm> arm = measure::ReadArm(folder, faults);
    err << config::FaultsText(faults);
    if (!arm) return Error{arm.error()};
    const Result<std::string> rows =
        files::ReadFileUpTo(files::kTableSize, measure::RowsFileOf(folder));
    const auto [owner, is_new] = owner_of_rows.emplace(text::Sha256Hex(rows ? *rows : ""), folder);
    if (!is_new) {
      return Error{fmt::format("{}: has the same rows as {}: they would count twice; leave it out",
                               folder, owner->second)};
    }
    if (const Result<void> own = CheckRepeatedRows(arguments, input, arms, *arm); !own) {
      return Error{own.error()};
    }
    const std::string difference = measure::DifferenceOf(input.cell, arm->cell);
    if (!difference.empty()) {
      return Error{fmt::format("{}: cannot be compared with {}: {}; leave it out", folder,
                               arguments.cell, difference)};
    }
    arms.push_back(std::move(arm).value());
  }
  return arms;
}

}  // namespace

Result<DiagnoseInput> ReadDiagnoseInput(const DiagnoseArguments& arguments, std::ostream& err) {
  const Result<std::string> cell_text = files::ReadTextFile(arguments.cell);
  const Result<std::string> table_text = files::ReadFileUpTo(files::kTableSize, arguments.measured);
  if (!cell_text)
    return Error{arguments.cell + ": " + files::ReadErrorText(arguments.cell, cell_text.error())};
  if (!table_text)
    return Error{arguments.measured + ": " +
                 files::ReadErrorText(arguments.measured, table_text.error())};
  config::FaultList faults;
  const auto cell = config::CellFromText(*cell_text, arguments.cell, faults);
  std::optional<measure::MeasuredTable> measured;
  if (cell) {
    measured = measure::TableFromCsv(*table_text, arguments.measured, cell->robot.joints, faults);
  }
  err << config::FaultsText(faults);
  if (!cell || !measured) return Error{""};
  DiagnoseInput input{*cell_text, text::Sha256Hex(*table_text), *cell, std::move(*measured), 0, {},
                      {}};
  input.rows = input.measured.rows.size();
  input.unreadable_lines = input.measured.unreadable_lines;
  const Result<std::vector<measure::Arm>> arms = ReadSiblings(arguments, input, err);
  if (!arms) return Error{arms.error()};
  input.siblings = *arms;
  return input;
}

}  // namespace plumbline::cli
