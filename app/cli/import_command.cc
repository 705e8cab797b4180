// plumbline import: exports of instruments and robots as measured.csv.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "app/base/config/cell_reader.h"
#include "app/base/config/fault.h"
#include "app/base/config/required_file.h"
#include "app/base/config/wrong_file.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/output_file.h"
#include "app/measure/diagnosis/hypotheses/gross_errors.h"
#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "app/measure/imports/ask.h"
#include "app/measure/imports/preview.h"
#include "app/measure/imports/whole_turns.h"
#include "app/measure/table/csv.h"
#include "drivers/files/text_file.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/kinematics/chain.h"
#include "firmware-like/model/cell_model.h"
#include "firmware-like/model/joint_columns.h"
#include "firmware-like/plausibility_filter.h"

namespace plumbline::cli {
namespace {

// Check of imported joint readings against the joint limits of a cell.

std::vector<const measure::MeasuredRow*> AllRows(const measure::MeasuredTable& table) {
  std::vector<const measure::MeasuredRow*> rows;
  for (const auto* list : {&table.rows, &table.unmeasured}) {
    for (const measure::MeasuredRow& row : *list) rows.push_back(&row);
  }
  return rows;
}

/// True if the angles were probably degrees that were read as radians: a joint is turned by more
/// than two turns, and every row is within the limits once the factor is undone.
bool AreDegrees(const kinematics::Chain& chain,
                const std::vector<const measure::MeasuredRow*>& rows, double margin) {
  constexpr double kTwoTurns_rad = 4 * std::numbers::pi;
  double largest_rad = 0;
  const bool fit = std::all_of(rows.begin(), rows.end(), [&](const measure::MeasuredRow* row) {
    model::JointVector q = row->q;
    for (int j = 0; j < chain.size(); ++j) {
      if (chain.type(j) != model::JointType::kRevolute) continue;
      largest_rad = std::max(largest_rad, std::abs(q[j]));
      q[j] *= kRadPerDeg;
    }
    return chain.WithinLimits(q, margin);
  });
  return fit && largest_rad > kTwoTurns_rad;
}

std::string Remedy(bool are_degrees, const std::string& angle_unit) {
  if (are_degrees) {
    return angle_unit == "rad"
               ? "all rows fit if the angles are in degrees: give --angle-unit deg"
               : "all rows fit if the angles are divided by 57.2958: degrees were converted to "
                 "degrees once more; correct the values, or their unit in the file or mapping";
  }
  return "check --angle-unit, the order of the joints and the limits of the cell; without --cell "
         "the limits are not checked";
}

/// Adds a fault for the first joint of which a row is outside the limits by more than 0.02 rad or
/// 20 mm, the margin of the daemon's plausibility filter. Rows without a measurement count too.
/// @param angle_unit  that the user stated for columns without a unit; empty if none
void CheckImportedJoints(const model::CellModel& cell, const measure::MeasuredTable& table,
                         const std::string& angle_unit, config::FaultList& faults) {
  const double margin = PlausibilityLimits{}.limit_margin_rad;
  const kinematics::Chain chain(cell.robot);
  const std::vector<const measure::MeasuredRow*> rows = AllRows(table);
  for (int j = 0; j < chain.size(); ++j) {
    const double low = chain.lower()[j], high = chain.upper()[j];
    const measure::MeasuredRow* first = nullptr;
    int outside = 0;
    for (const measure::MeasuredRow* row : rows) {
      if (row->q[j] >= low - margin && row->q[j] <= high + margin) continue;
      ++outside;
      if (first == nullptr || row->line < first->line) first = row;
    }
    if (first == nullptr) continue;
    const double unit = model::PositionForm(chain.type(j)).to_SI;
    faults.Add(
        {config::Fault::Severity::kFault, table.file, first->line,
         model::JointColumnName(model::JointQuantity::kPosition, chain.type(j), j),
         fmt::format("{:.6g} is outside the joint limits {:.6g} to {:.6g} of the cell, as in "
                     "{} of {} row{}; no file is written; {}",
                     first->q[j] / unit, low / unit, high / unit, outside, rows.size(),
                     rows.size() == 1 ? "" : "s",
                     Remedy(AreDegrees(chain, rows, margin), angle_unit))});
    return;
  }
}

struct ImportCommandOptions {
  std::string file, joints, mapping, joints_mapping, out, cell, permissible_error;
  bool preview = false;
  measure::ImportOptions units;
};

/// "15+6": 15 um + 6 um/m.
std::optional<measure::PermissibleError> PermissibleErrorOf(const std::string& text) {
  const auto plus = text.find('+');
  const auto constant = text::NumberIn(text.substr(0, plus), '.');
  const auto slope = plus == std::string::npos ? std::optional<double>(0)
                                               : text::NumberIn(text.substr(plus + 1), '.');
  if (!constant || !slope || *constant < 0 || *slope < 0) return std::nullopt;
  return measure::PermissibleError{1e-3 * *constant, 1e-3 * *slope};
}

/// The mapping of a file: from the mapping file if it exists; else asked on a terminal, or what was
/// understood, and kept in that file. Nothing is kept for a preview.
class MappedFile {
 public:
  MappedFile(const ImportCommandOptions& options, measure::FileRole role)
      : options_(options),
        role_(role),
        path_(role == measure::FileRole::kJoints ? options.joints : options.file),
        mapping_path_(role == measure::FileRole::kJoints ? options.joints_mapping
                                                         : options.mapping) {}

  /// @return nullopt after a fault
  std::optional<measure::UnderstoodFile> Read(config::FaultList& faults) {
    const auto bytes = config::ReadRequiredFile(path_, faults, files::kTableSize);
    if (!bytes || config::RefuseWrongFile(*bytes, path_, config::kWantedTable, faults)) {
      return std::nullopt;
    }
    measure::Mapping mapping;
    const bool known = !mapping_path_.empty() && std::filesystem::exists(mapping_path_);
    if (known) {
      const auto text = config::ReadRequiredFile(mapping_path_, faults);
      const bool wrong =
          text && config::RefuseWrongFile(*text, mapping_path_, config::kWantedMapping, faults);
      const auto read =
          text && !wrong ? measure::MappingFromText(*text, mapping_path_, faults) : std::nullopt;
      if (!read) return std::nullopt;
      mapping = *read;
    }
    config::FaultList own;
    auto file =
        measure::Understand(*bytes, path_, role_, mapping, mapping_path_, options_.units, own);
    if (!known && !mapping_path_.empty() && !options_.preview) {
      if (const auto asked = Asked(file)) {
        own = {};
        file =
            measure::Understand(*bytes, path_, role_, *asked, mapping_path_, options_.units, own);
        Keep(*asked);
      }
    }
    faults.Append(own);
    return file;
  }

 private:
  static std::optional<measure::Mapping> Asked(const measure::UnderstoodFile& file) {
    if (isatty(STDIN_FILENO) == 0) return measure::MappingOf(file);
    return measure::AskMapping(file, std::cin, std::cerr);
  }
  void Keep(const measure::Mapping& mapping) const {
    const auto written = files::WriteTextFile(mapping_path_, measure::TextOfMapping(mapping));
    std::cerr << (written ? fmt::format("{}: mapping written; edit it to change the import\n",
                                        mapping_path_)
                          : UnwritableText(mapping_path_, written.error(), "--mapping"));
  }

  const ImportCommandOptions& options_;
  measure::FileRole role_;
  std::string path_, mapping_path_;
};

/// Reads the written text as the diagnosis will, with the joints of the cell, and looks for the
/// same mistakes: rows that belong together may have been read from two files in different orders.
void CheckAgainstCell(const ImportCommandOptions& options, const model::CellModel& cell,
                      const std::string& csv, config::FaultList& faults) {
  const auto table = measure::TableFromCsv(csv, options.out.empty() ? "measured.csv" : options.out,
                                           cell.robot.joints, faults);
  if (!table) return;
  CheckImportedJoints(cell, *table, options.units.angle_unit, faults);
  if (faults.HasFaults() || !table->recorded.position) return;
  const Result<measure::Dataset> data = measure::DatasetFrom(cell, *table);
  if (!data) return;  // not yet what a diagnosis needs
  constexpr int kThreads = 2;
  const Result<measure::DeclaredFit> fit = measure::FitDeclared(*data, kThreads);
  if (fit && !fit->mistake) return;
  // Rows of two files may have been put together in a wrong order: the table would then be wrong
  // whatever the cell.
  const bool misjoined = !options.joints.empty() && fit && fit->mistake->row_order;
  faults.Add({misjoined ? config::Fault::Severity::kFault : config::Fault::Severity::kWarning,
              options.file, 0, "",
              fmt::format("does not fit {}: {}{}", options.cell,
                          fit ? fit->mistake->sentence : fit.error(),
                          misjoined ? "; no file is written" : "")});
}

/// "ignored columns: \"a\", \"b\"; map ..", or empty. A long list is cut.
std::string IgnoredText(const measure::UnderstoodFile& file) {
  constexpr std::size_t kMost = 20;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < file.meanings.size(); ++i) {
    if (!file.meanings[i].target.empty()) continue;
    const std::string& name = file.layout.names[i];
    names.push_back(name.empty() ? fmt::format("column {} (without a name)", i + 1)
                                 : fmt::format("\"{}\"", name.substr(0, 40)));
  }
  if (names.empty()) return "";
  const std::size_t more = names.size() - std::min(kMost, names.size());
  names.resize(names.size() - more);
  return fmt::format("ignored columns: {}{}; map those that hold measurements with --mapping",
                     fmt::join(names, ", "), more > 0 ? fmt::format(" and {} more", more) : "");
}

/// Prints the columns of a file that are not used.
void PrintIgnored(const measure::UnderstoodFile& file) {
  const std::string ignored = IgnoredText(file);
  if (!ignored.empty()) std::cerr << file.file << ": " << ignored << '\n';
}

/// Faults of a table that cannot be measured.csv.
void CheckRows(const ImportCommandOptions& options, const measure::UnderstoodFile& file,
               const measure::ImportedTable& rows, config::FaultList& faults) {
  const auto has = [&](auto&& test) {
    return std::any_of(rows.rows.begin(), rows.rows.end(), test);
  };
  const auto fault = [&](const std::string& what) {
    faults.Add({config::Fault::Severity::kFault, options.file, 0, "", what});
  };
  if (!has([](const measure::ImportedRow& row) { return row.HasJoints(); })) {
    fault(
        "has no joint columns (q1, joint 1, J1, A1 ..): give the file of the joints with "
        "--joints, or map the columns to q1_deg ..");
  }
  const bool gauge = has([](const measure::ImportedRow& row) {
    return row.numbers.contains("gauge_mm") && !row.texts.contains("artefact");
  });
  if (gauge) fault("holds gauge readings: name the [[artefact]] of the cell with --artefact");
  const bool has_length = has([](const measure::ImportedRow& row) {
    const auto& n = row.numbers;
    return n.contains("x_mm") || n.contains("range_mm") || n.contains("gauge_mm");
  });
  if (options.units.permissible_error && !has_length) {
    fault(
        "holds no position, range or gauge reading to which --permissible-error-um applies; "
        "leave it out");
  }
  if (!has([](const measure::ImportedRow& row) { return row.HasMeasurement(); })) {
    fault(
        "has no row with a usable measurement: a position, range, gauge reading, orientation or "
        "touched artefact" +
        (IgnoredText(file).empty() ? "" : "; " + IgnoredText(file)));
  }
}

int PreviewYaml(const ImportCommandOptions& options) {
  config::FaultList faults;
  const auto text = config::ReadRequiredFile(options.file, faults, files::kTableSize);
  const bool wrong =
      text && config::RefuseWrongFile(*text, options.file, config::kWantedTable, faults);
  std::cerr << config::FaultsText(faults);
  if (!text || wrong) return kExitFault;
  const auto shown = measure::RobotCalibrationText(*text);
  if (!shown) std::cerr << options.file << ": " << shown.error() << '\n';
  if (!shown) return kExitFault;
  std::cout << options.file << ": " << *shown;
  if (options.preview) return kExitOk;
  std::cerr << options.file
            << ": holds results, not measurements; no file was written; use import-urdf "
               "--apply-rising for the URDF written beside it\n";
  return kExitFault;
}

void PrintRejected(const measure::ImportedTable& rows) {
  for (const measure::RejectedLine& line : rows.rejected) {
    std::cerr << fmt::format("{}:{}: rejected: {}\n", line.file, line.line, line.reason);
  }
}

std::string CountsText(const measure::ImportedTable& rows) {
  const auto measured =
      std::count_if(rows.rows.begin(), rows.rows.end(),
                    [](const measure::ImportedRow& row) { return row.HasMeasurement(); });
  const auto count = [](std::size_t number, const char* noun) {
    return fmt::format("{} {}{}", number, noun, number == 1 ? "" : "s");
  };
  return fmt::format("{}, {} with a measurement; {} rejected", count(rows.rows.size(), "row"),
                     measured, count(rows.rejected.size(), "line"));
}

int WriteImport(const ImportCommandOptions& options, const measure::ImportedTable& rows,
                const std::string& csv) {
  if (!PrintOrWriteOutput(options.out, csv, "--output")) return kExitUsage;
  PrintRejected(rows);
  for (const std::string& note : rows.notes) std::cerr << note << '\n';
  std::cerr << fmt::format("{}: {}\n", options.out, CountsText(rows));
  return kExitOk;
}

void PrintPreviews(const ImportCommandOptions& options, const measure::UnderstoodFile& file,
                   const std::optional<measure::UnderstoodFile>& joints) {
  std::cout << PreviewText(file, RowsOf(file, options.units));
  if (joints) std::cout << PreviewText(*joints, RowsOf(*joints, options.units));
}

int ImportFiles(const ImportCommandOptions& options) {
  config::FaultList faults;
  const auto file = MappedFile(options, measure::FileRole::kMeasured).Read(faults);
  std::optional<measure::UnderstoodFile> joints;
  if (!options.joints.empty()) {
    joints = MappedFile(options, measure::FileRole::kJoints).Read(faults);
  }
  if (!file || (!options.joints.empty() && !joints)) {
    std::cerr << config::FaultsText(faults);
    return kExitFault;
  }
  if (faults.HasFaults()) {
    // Printed before the preview and without rejected rows: a missing unit would reject all of
    // them.
    std::cerr << config::FaultsText(faults);
    if (options.preview) PrintPreviews(options, *file, joints);
    return kExitFault;
  }
  measure::ImportedTable rows = RowsOf(*file, options.units), of_joints;
  if (options.preview) PrintPreviews(options, *file, joints);
  if (joints) of_joints = RowsOf(*joints, options.units);
  std::set<std::string> previewed(rows.notes.begin(), rows.notes.end());
  previewed.insert(of_joints.notes.begin(), of_joints.notes.end());
  if (joints) rows = WithJoints(rows, of_joints, options.joints, faults);
  const bool joints_given = std::any_of(rows.rows.begin(), rows.rows.end(),
                                        [](const auto& row) { return row.HasJoints(); });
  if (joints_given) RejectRowsWithoutJoints(rows);
  if (!faults.HasFaults()) CheckRows(options, *file, rows, faults);
  config::FaultList of_cell;
  const auto cell = options.cell.empty() ? std::nullopt : config::ReadCell(options.cell, of_cell);
  if (cell) SubtractWholeTurns(cell->robot, PlausibilityLimits{}.limit_margin_rad, rows);
  const std::string csv = MeasuredCsv(rows);
  if (cell && !faults.HasFaults()) CheckAgainstCell(options, *cell, csv, faults);
  if (!cell) faults.Append(of_cell);
  std::cerr << config::FaultsText(faults);
  if (faults.HasFaults() || options.preview) PrintRejected(rows);
  if (faults.HasFaults()) return kExitFault;
  if (!options.preview) {
    PrintIgnored(*file);
    if (joints) PrintIgnored(*joints);
    return WriteImport(options, rows, csv);
  }
  std::cout << "measured.csv: " << CountsText(rows) << '\n';
  for (const std::string& note : rows.notes) {
    if (!previewed.contains(note)) std::cout << "  " << note << '\n';
  }
  return kExitOk;
}

/// The files that are written: mapping files only if they do not exist.
OutputPaths OutputsOf(const ImportCommandOptions& options) {
  return {{"--mapping", std::filesystem::exists(options.mapping) ? "" : options.mapping},
          {"--joints-mapping",
           std::filesystem::exists(options.joints_mapping) ? "" : options.joints_mapping},
          {"--output", options.out}};
}

std::vector<std::string> InputsOf(const ImportCommandOptions& options) {
  std::vector<std::string> inputs = {options.file, options.joints, options.cell};
  for (const std::string& mapping : {options.mapping, options.joints_mapping}) {
    if (std::filesystem::exists(mapping)) inputs.push_back(mapping);
  }
  return inputs;
}

int RunImport(ImportCommandOptions options) {
  if (options.preview != options.out.empty()) {
    std::cerr << "plumbline import: give either --preview or --output FILE\n";
    return kExitUsage;
  }
  if (OverwritesFile("import", OutputsOf(options), InputsOf(options), std::cerr)) {
    return kExitUsage;
  }
  if (!options.permissible_error.empty()) {
    options.units.permissible_error = PermissibleErrorOf(options.permissible_error);
    if (!options.units.permissible_error) {
      std::cerr << "plumbline import: --permissible-error-um: " << options.permissible_error
                << " is not of the form 15+6 (um + um/m)\n";
      return kExitUsage;
    }
  }
  const bool yaml = options.file.ends_with(".yaml") || options.file.ends_with(".yml");
  return yaml ? PreviewYaml(options) : ImportFiles(options);
}

}  // namespace

void AddImportCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ImportCommandOptions>();
  CLI::App* command =
      app.add_subcommand("import", "Turn exports of trackers, CMMs and gauges into measured.csv");
  command->add_option("file", options->file, "Export of the instrument, or a table with everything")
      ->required();
  command->add_option("--joints", options->joints, "Second file with the joint readings");
  command->add_flag("--preview", options->preview, "Only show what was understood");
  command->add_option("--output,--out", options->out,
                      "measured.csv to write; - is standard output");
  command->add_option("--mapping", options->mapping,
                      "Mapping file; if it does not exist, it is asked for on a terminal and "
                      "written");
  command->add_option("--joints-mapping", options->joints_mapping,
                      "The same for the file of the joints");
  command
      ->add_option("--length-unit", options->units.length_unit,
                   "Unit of lengths whose column states none: mm, m, um, in")
      ->check(CLI::IsMember({"mm", "m", "cm", "um", "in"}));
  command->add_option("--angle-unit", options->units.angle_unit, "The same for angles: deg, rad")
      ->check(CLI::IsMember({"deg", "rad", "mrad"}));
  command
      ->add_option("--temperature-unit", options->units.temperature_unit,
                   "The same for temperatures: C, K, F")
      ->check(CLI::IsMember({"C", "K", "F"}));
  command
      ->add_option_function<std::string>(
          "--decimal",
          [options](const std::string& word) {
            options->units.decimal = word == "comma" ? ',' : '.';
          },
          "Decimal sign, if the file leaves it open: comma, point")
      ->check(CLI::IsMember({"comma", "point"}));
  command->add_option("--artefact", options->units.artefact,
                      "[[artefact]] of the cell to which gauge or range readings belong");
  command->add_option("--permissible-error-um", options->permissible_error,
                      "Permissible error of the instrument, um + um/m, such as 15+6; added to "
                      "sigma_mm");
  command->add_option(
      "--cell", options->cell,
      "Cell whose joints and joint limits the result must fit; a joint counted from 0 "
      "to 360 is brought within them");
  command->footer(
      "Separator, decimal sign, column names and units are found in the file; --preview shows "
      "them.\n"
      "A unit that the file does not state must be given. U(95) becomes sigma_mm (k = 2). Joints "
      "of\n"
      "a second file are matched by a column with the number or name of the point, else by time, "
      "and\n"
      "by row only where numbers and times do not contradict it.\n"
      "Lines without a usable measurement are named and keep only their joints.\n\n"
      "Examples:\n"
      "  plumbline import tracker.csv --joints joints.csv --angle-unit rad --preview\n"
      "  plumbline import tracker.csv --joints joints.csv --output measured.csv\n"
      "  plumbline import table.csv --mapping lab.toml --output measured.csv\n\n"
      "Exit codes: 0 success, 1 faults in a file, 2 wrong arguments or unwritable output.");
  command->callback([options, &exit_code] { exit_code = RunImport(*options); });
}

}  // namespace plumbline::cli
