#include "app/measure/imports/preview.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/base/text/yaml_scalars.h"

namespace plumbline::measure {
namespace {

constexpr std::size_t kShownRows = 3;
constexpr std::size_t kShownRejected = 20;

const char* SeparatorName(char separator) {
  return separator == ','   ? "comma"
         : separator == ';' ? "semicolon"
         : separator == ' ' ? "blanks"
                            : "tab";
}

std::string LayoutText(const UnderstoodFile& file) {
  const text::DelimitedText& layout = file.layout;
  std::string text = fmt::format(
      "{}: {}, separator {}, decimal {}{}, {}\n", file.file, file.encoding,
      SeparatorName(layout.separator), layout.decimal == ',' ? "comma" : "point",
      layout.decimal_assumed ? " (assumed: every comma is followed by three digits; give --decimal)"
                             : "",
      layout.header_line > 0 ? fmt::format("column names in line {}", layout.header_line)
                             : "no column names");
  for (const std::string& line : layout.preamble) {
    text += fmt::format("  skipped: {}\n", line.substr(0, 70));
  }
  return text;
}

std::string ColumnsText(const UnderstoodFile& file) {
  std::string text = "  column                     meaning     unit   from\n";
  for (std::size_t i = 0; i < file.meanings.size(); ++i) {
    const ColumnMeaning& meaning = file.meanings[i];
    const std::string& name = file.layout.names[i];
    text += fmt::format(
        "  {:>3} {:<22} {:<11} {:<6} {}\n", i + 1, name.substr(0, 22),
        meaning.target.empty() ? "ignored" : meaning.target, meaning.unit,
        meaning.target.empty() && meaning.because == "name" ? "not known" : meaning.because);
  }
  return text;
}

}  // namespace

std::string PreviewText(const UnderstoodFile& file, const ImportedTable& table) {
  std::string text = LayoutText(file) + ColumnsText(file);
  if (!file.readable) {
    return text + "  rows not read: a column lacks a known unit or has another decimal sign\n";
  }
  const auto without = std::ranges::count_if(
      table.rows, [](const ImportedRow& row) { return !row.HasMeasurement(); });
  text += fmt::format("  {} row{}, {} of them without a usable measurement\n", table.rows.size(),
                      table.rows.size() == 1 ? "" : "s", without);
  for (std::size_t i = 0; i < std::min(kShownRejected, table.rejected.size()); ++i) {
    text +=
        fmt::format("  line {}: rejected: {}\n", table.rejected[i].line, table.rejected[i].reason);
  }
  if (table.rejected.size() > kShownRejected) {
    text += fmt::format("  and {} more\n", table.rejected.size() - kShownRejected);
  }
  for (const std::string& note : table.notes) text += "  " + note + '\n';
  for (std::size_t i = 0; i < std::min(kShownRows, table.rows.size()); ++i) {
    const ImportedRow& row = table.rows[i];
    text += fmt::format("  line {}:", row.line);
    for (const auto& [name, value] : row.texts) text += fmt::format(" {} {}", name, value);
    for (const auto& [name, value] : row.numbers) text += fmt::format(" {} {:.6g}", name, value);
    text += '\n';
  }
  return text;
}

Result<std::string> RobotCalibrationText(std::string_view yaml) {
  const auto scalars = text::ScalarsFromYaml(yaml);
  if (!scalars) return scalars.failure();
  std::string parameters, files;
  for (const text::YamlScalar& scalar : *scalars) {
    const bool names_file = scalar.path == "urdf" || scalar.path.ends_with("_info");
    const auto number = text::NumberIn(scalar.value, '.');
    if (names_file) files += fmt::format("  {:<40} {}\n", scalar.path, scalar.value);
    if (number && !names_file) {
      parameters += fmt::format("  {:<40} {:.9g}\n", scalar.path, *number);
    }
  }
  if (parameters.empty()) {
    return Error{
        "holds no `parameter: value` lines; a calibration of robot_calibration was expected"};
  }
  return "results of robot_calibration (joint offsets in rad or m, frames in m and rad):\n" +
         parameters + (files.empty() ? "" : "files:\n" + files) +
         "These are parameters, not measurements. Import the URDF that was written beside this "
         "file:\n  plumbline import-urdf calibrated.urdf --apply-rising --output cell.toml\n";
}

}  // namespace plumbline::measure
