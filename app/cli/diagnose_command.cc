#include "app/cli/diagnose_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstddef>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "app/base/config/cell_reader.h"
#include "app/base/config/model_fingerprint.h"
#include "app/base/terminal/terminal_output.h"
#include "app/base/text/sha256.h"
#include "app/base/text/text.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/number_option.h"
#include "app/cli/output_file.h"
#include "app/cli/progress.h"
#include "app/measure/diagnosis/diagnose.h"
#include "app/measure/diagnosis/output/answer.h"
#include "app/measure/diagnosis/output/model_writer.h"
#include "app/measure/diagnosis/output/summary.h"
#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/report/pdf.h"
#include "app/measure/report/report.h"
#include "app/measure/siblings/installed_prior.h"
#include "app/measure/siblings/prior_json.h"
#include "app/measure/siblings/repeated_rows.h"
#include "app/measure/siblings/sibling_folder.h"
#include "app/measure/siblings/siblings.h"
#include "app/measure/table/csv.h"
#include "app/version.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/text_file.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/cell_model.h"
#include "firmware-like/result.h"

namespace plumbline::cli {
namespace {

namespace fs = std::filesystem;

// Input files of plumbline diagnose: cell, rows, siblings and prior.

/// Content of the input files of plumbline diagnose.
struct DiagnoseInput {
  std::string cell_text;
  std::string data_sha256;
  std::vector<std::string> row_sketch;  ///< if --arm-out is given
  model::CellModel cell;
  measure::MeasuredTable measured;  ///< moved into the diagnosis
  std::size_t rows = 0;
  std::vector<int> unreadable_lines;
  std::vector<measure::Arm> siblings;
  /// Of this arm model; an error states why the one that is there cannot be used.
  std::optional<Result<measure::FleetPrior>> prior;
  std::vector<std::string> notes;  ///< on further priors
};

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

/// Looks for a prior of the cell's arm model. A file that was named must be usable; of a named
/// folder the answer says why it has none.
Result<void> ReadPrior(const DiagnoseArguments& arguments, DiagnoseInput& input) {
  const bool given = arguments.prior != measure::kPriorFolder;
  const bool named = given && !fs::is_directory(arguments.prior);
  const bool wanted = arguments.siblings.empty() && arguments.arm_out.empty();
  const std::string& model = input.cell.robot.identity.model;
  if (arguments.prior.empty() || !wanted || (!given && model.empty())) return {};
  if (!named && model.empty()) {
    input.prior = Error{
        fmt::format("{}: the cell file names no arm model; give [robot] model", arguments.prior)};
    return {};
  }
  measure::InstalledPrior found =
      measure::FindPrior(arguments.prior, arguments.prior_keys, input.cell);
  if (found.prior) {
    input.prior = measure::WithoutArmOf(input.measured, std::move(*found.prior));
    input.notes = std::move(found.problems);
  } else if (!found.problems.empty()) {
    Error problems{fmt::format("{}", fmt::join(found.problems, "; "))};
    if (named) return problems;
    input.prior = std::move(problems);
  } else if (given) {
    input.prior = Error{fmt::format("{}: holds no prior of {}", arguments.prior, model)};
  }
  return {};
}

/// Reads all input files. Faults of the cell and of the rows are printed to `err`; the error is
/// then empty.
Result<DiagnoseInput> ReadDiagnoseInput(const DiagnoseArguments& arguments, std::ostream& err) {
  const Result<std::string> cell_text = files::ReadTextFile(arguments.cell);
  const Result<std::string> table_text = files::ReadFileUpTo(files::kTableSize, arguments.measured);
  if (!cell_text)
    return Error{arguments.cell + ": " + files::ReadErrorText(arguments.cell, cell_text.error())};
  if (!table_text)
    return Error{arguments.measured + ": " +
                 files::ReadErrorText(arguments.measured, table_text.error())};
  config::FaultList faults;
  auto cell = config::CellFromText(*cell_text, arguments.cell, faults);
  std::string text = *cell_text;
  if (cell && !cell->effects.empty() && !arguments.arm_out.empty()) {
    // Arms are compared as declared: the effects of a corrected cell are what is asked for.
    config::FaultList known;
    text = measure::WithoutTable(text, "effect");
    cell = config::CellFromText(text, arguments.cell, known);
  }
  std::optional<measure::MeasuredTable> measured;
  if (cell) {
    measured = measure::TableFromCsv(*table_text, arguments.measured, cell->robot.joints, faults);
  }
  err << config::FaultsText(faults);
  if (!cell || !measured) return Error{""};
  DiagnoseInput input{std::move(text),
                      text::Sha256Hex(*table_text),
                      {},
                      *cell,
                      std::move(*measured),
                      0,
                      {},
                      {},
                      {},
                      {}};
  if (!arguments.arm_out.empty())
    input.row_sketch = measure::RowSketch(input.measured, input.cell.robot.joints);
  input.rows = input.measured.rows.size();
  input.unreadable_lines = input.measured.unreadable_lines;
  const Result<std::vector<measure::Arm>> arms = ReadSiblings(arguments, input, err);
  if (!arms) return Error{arms.error()};
  input.siblings = *arms;
  if (const Result<void> prior = ReadPrior(arguments, input); !prior) return prior.failure();
  return input;
}

// Output files of plumbline diagnose: corrected model, report, proposed poses and JSON.

/// A file to be written at the end, and its content.
struct DiagnoseOutput {
  std::string option, path, text;
};

std::string Today() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  char text[16];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%d", &local)};
}

/// Path of the file for proposed poses; empty if none is to be written.
std::string NextPosesPath(const DiagnoseArguments& arguments) {
  if (!arguments.next_poses.empty()) return arguments.next_poses;
  if (arguments.json.empty() || arguments.json == "-") return "";
  std::error_code unknown;
  const bool special =
      fs::exists(arguments.json, unknown) && !fs::is_regular_file(arguments.json, unknown);
  return special ? "" : (fs::path(arguments.json).parent_path() / "next_poses.csv").string();
}

/// The reference to the poses file in the JSON file: only its name if both are in one folder.
std::string NameForJson(const std::string& poses, const std::string& json) {
  const fs::path path(poses);
  return path.parent_path() == fs::path(json).parent_path() ? path.filename().string() : poses;
}

/// Fingerprint of a valid cell's model; empty if the text cannot be parsed.
std::string FingerprintOf(const std::string& cell_text) {
  config::FaultList ignored;
  const config::TomlDocument document(cell_text, "", ignored);
  return document.parsed() ? config::ModelFingerprint(document) : "";
}

/// The corrected cell; empty, with the reason in `err`, if it would not be a valid one.
std::string CorrectedCell(const DiagnoseArguments& arguments, const DiagnoseInput& input,
                          const measure::Diagnosis& diagnosis, const measure::DataOrigin& origin,
                          std::ostream& err) {
  const auto model = measure::CorrectedCellText(input.cell_text, input.cell, diagnosis, origin);
  if (model) return *model;
  err << arguments.model
      << ": not written, because the corrected model would not be a valid cell. A residual or "
         "value this large indicates a mistake in the data (units, columns, another cell) "
         "rather than an effect:\n"
      << model.error();
  return "";
}

std::string ReportOf(const DiagnoseArguments& arguments, const DiagnoseInput& input,
                     const measure::Diagnosis& diagnosis, const measure::DataOrigin& origin,
                     const std::string& corrected_cell) {
  const measure::ReportSource source{
      fs::path(arguments.cell).filename().string(),
      origin.file,
      origin.rows,
      input.unreadable_lines,
      kVersionAndBuild,
      text::TextOfUtcNow(),
      text::Sha256Hex(input.cell_text),
      input.data_sha256,
      FingerprintOf(input.cell_text),
      corrected_cell.empty() ? std::string() : FingerprintOf(corrected_cell),
      arguments.certificate_details};
  return measure::ReportHtml(diagnosis, input.cell, source);
}

/// Checks that no output overwrites an input or another output, that all can be written and that
/// a PDF can be made; prints every violation to `err`.
bool CheckDiagnoseOutputs(const DiagnoseArguments& arguments, std::ostream& err) {
  const OutputPaths outputs = {{"--json", arguments.json},
                               {"--write-model", arguments.model},
                               {"--report", arguments.report},
                               {"--pdf", arguments.pdf},
                               {"--next-poses", NextPosesPath(arguments)},
                               {"--arm-out", arguments.arm_out}};
  std::vector<std::string> inputs = {arguments.cell, arguments.measured};
  for (const std::string& folder : arguments.siblings) {
    inputs.push_back(measure::CellFileOf(folder));
    inputs.push_back(measure::RowsFileOf(folder));
  }
  bool writable = !OverwritesFile("diagnose", outputs, inputs, err);
  for (const auto& [option, path] : outputs) {
    if (path.empty() || path == "-") continue;
    if (path != arguments.next_poses && option == std::string_view("--next-poses"))
      continue;  // beside --json
    if (const Result<void> can_write = files::CheckWritable(path); !can_write) {
      err << UnwritableText(path, can_write.error(), option);
      writable = false;
    }
  }
  if (arguments.pdf.empty()) return writable;
  const std::string why = measure::WhyNoPdf();
  if (!why.empty()) err << fmt::format("plumbline diagnose: --pdf: {}\n", why);
  return writable && why.empty();
}

/// The requested files, the JSON last, so that the files it refers to exist once it appears. One
/// that cannot be made is missing, and `err` receives the reason.
std::vector<DiagnoseOutput> DiagnoseOutputs(const DiagnoseArguments& arguments,
                                            const DiagnoseInput& input,
                                            const measure::Diagnosis& diagnosis,
                                            std::ostream& err) {
  std::vector<DiagnoseOutput> outputs;
  const measure::DataOrigin origin{fs::path(arguments.measured).filename().string(),
                                   static_cast<int>(input.rows), Today()};
  std::string corrected_cell;
  if (!arguments.model.empty())
    corrected_cell = CorrectedCell(arguments, input, diagnosis, origin, err);
  if (!corrected_cell.empty())
    outputs.push_back({"--write-model", arguments.model, corrected_cell});
  if (!arguments.report.empty() || !arguments.pdf.empty()) {
    const std::string html = ReportOf(arguments, input, diagnosis, origin, corrected_cell);
    if (!arguments.report.empty()) outputs.push_back({"--report", arguments.report, html});
    if (!arguments.pdf.empty()) {
      const Result<std::string> pdf = measure::PdfFromHtml(html);
      if (pdf) {
        outputs.push_back({"--pdf", arguments.pdf, *pdf});
      } else {
        err << fmt::format("{}: not written: {}\n", arguments.pdf, pdf.error());
      }
    }
  }
  if (!arguments.arm_out.empty()) {
    const Result<measure::ArmSizes> arm = measure::SizesOfArm(
        arguments.arm_name.empty() ? input.cell.robot.name : arguments.arm_name, input.data_sha256,
        input.row_sketch, input.cell_text, input.cell, diagnosis, origin.date);
    if (arm) {
      outputs.push_back({"--arm-out", arguments.arm_out, measure::JsonFrom(*arm)});
    } else {
      err << fmt::format("{}: not written: {}\n", arguments.arm_out, arm.error());
    }
  }
  std::string poses = diagnosis.next_poses.empty() ? "" : NextPosesPath(arguments);
  if (!poses.empty()) {
    outputs.push_back({"--next-poses", poses, measure::NextPosesCsv(diagnosis, input.cell)});
    poses = NameForJson(poses, arguments.json);
  }
  if (!arguments.json.empty())
    outputs.push_back({"--json", arguments.json, measure::AnswerJson(diagnosis, poses)});
  return outputs;
}

/// Writes each file atomically, and the text of path "-" to `out`.
/// @return  whether all could be written; `err` receives the failures
bool WriteDiagnoseOutputs(const std::vector<DiagnoseOutput>& outputs, std::ostream& out,
                          std::ostream& err) {
  bool written = true;
  for (const DiagnoseOutput& output : outputs) {
    if (output.path == "-") {
      out << output.text << std::flush;
      continue;
    }
    const Result<void> result = files::WriteTextFile(output.path, output.text);
    if (result) continue;
    err << UnwritableText(output.path, result.error(), output.option);
    written = false;
  }
  return written;
}

/// Runs the engine, with siblings or the prior if there are any.
Result<measure::Diagnosis> Diagnosed(const DiagnosisEngine& engine,
                                     const measure::DiagnosisOptions& options,
                                     DiagnoseInput& input) {
  if (!input.siblings.empty()) {
    return measure::DiagnoseWithSiblings(input.cell, input.measured, std::move(input.siblings),
                                         engine, options);
  }
  if (!input.prior) return engine(input.cell, std::move(input.measured), options);
  Result<measure::Diagnosis> diagnosis =
      measure::DiagnoseWithPrior(input.cell, input.measured, *input.prior, engine, options);
  if (diagnosis) {
    std::vector<std::string>& notes = diagnosis.value().notes;
    notes.insert(notes.end(), input.notes.begin(), input.notes.end());
  }
  return diagnosis;
}

measure::DiagnosisOptions OptionsOf(const DiagnoseArguments& arguments, Progress& progress) {
  measure::DiagnosisOptions options;
  options.threads = arguments.threads;
  options.time_zero_s = arguments.time_zero_s;
  options.order_unknown = arguments.order_unknown;
  options.progress = [&progress](double share, const std::string& doing) {
    progress.Show(share, doing);
  };
  options.interrupted = [] { return Interruption::Requested(); };
  return options;
}

/// An option whose text the report states.
struct DetailOption {
  const char* name;
  std::string measure::CertificateDetails::*text;
  const char* help;
};

constexpr DetailOption kDetailOptions[] = {
    {"--certificate-number", &measure::CertificateDetails::number, "Number of the certificate"},
    {"--robot-serial", &measure::CertificateDetails::robot_serial, "Serial number of the robot"},
    {"--site", &measure::CertificateDetails::site, "Where the robot is"},
    {"--measured-on", &measure::CertificateDetails::measured_on,
     "Date of the measurement, if --time-zero does not state the origin of t_s"},
    {"--instrument", &measure::CertificateDetails::instrument, "Measuring instrument"},
    {"--serial", &measure::CertificateDetails::instrument_serial,
     "Serial number of the instrument"},
    {"--calibration", &measure::CertificateDetails::calibration,
     "Calibration of the instrument: its certificate and date"},
    {"--approved-by", &measure::CertificateDetails::approved_by,
     "Who approves the report; without it, the report leaves a line to fill in"}};

/// The first given option that only the report states; null if none is given.
const char* OptionForReport(const measure::CertificateDetails& details) {
  for (const DetailOption& option : kDetailOptions) {
    if (!(details.*option.text).empty()) return option.name;
  }
  return nullptr;
}

/// What to do next.
std::string NextStep(const DiagnoseArguments& arguments, const measure::Diagnosis& diagnosis) {
  if (!diagnosis.next_poses.empty()) {
    const std::string poses = NextPosesPath(arguments);
    return poses.empty() ? "the same command with --next-poses next_poses.csv; measure these poses"
                         : fmt::format("measure the poses of {}, add them to {} and diagnose again",
                                       poses, arguments.measured);
  }
  if (diagnosis.declared_noise_too_small)
    return "measure one pose ten times, and declare the scatter as sigma_mm";
  if (diagnosis.verdict == measure::Verdict::kNoEffect)
    return "nothing: no effect above the noise needs to be corrected";
  if (diagnosis.verdict == measure::Verdict::kUnknown && arguments.report.empty())
    return "the same command with --report report.html, which shows what the residual follows";
  if (!diagnosis.withheld.empty()) return "";
  return arguments.model.empty() ? "the same command with --write-model corrected.toml"
                                 : "plumbline model propose " + arguments.model;
}

int Interrupted(std::ostream& err) {
  err << "interrupted; no file was changed\n";
  return kExitInterrupted;
}

}  // namespace

int RunDiagnose(const DiagnoseArguments& arguments, const DiagnosisEngine& engine,
                std::ostream& out, std::ostream& err) {
  const bool reported = !arguments.report.empty() || !arguments.pdf.empty();
  const char* report_only = OptionForReport(arguments.certificate_details);
  if (report_only != nullptr && !reported) {
    err << report_only << " is stated in the report only; add --report or --pdf\n";
    return kExitUsage;
  }
  if (!CheckDiagnoseOutputs(arguments, err)) return kExitUsage;
  Result<DiagnoseInput> input = ReadDiagnoseInput(arguments, err);
  if (!input) {
    if (!input.error().empty()) err << input.error() << '\n';
    return kExitFault;
  }
  Interruption interruption;
  Progress progress(err, arguments.quiet);
  const Result<measure::Diagnosis> diagnosis =
      Diagnosed(engine, OptionsOf(arguments, progress), input.value());
  progress.Clear();
  if (Interruption::Requested()) return Interrupted(err);
  if (!diagnosis) {
    err << arguments.measured << ": " << diagnosis.error() << '\n';
    return kExitFault;
  }
  const std::vector<DiagnoseOutput> outputs = DiagnoseOutputs(arguments, *input, *diagnosis, err);
  if (!interruption.Disarm()) return Interrupted(err);
  const bool written = WriteDiagnoseOutputs(outputs, out, err);
  if (!arguments.quiet) {
    (arguments.json == "-" ? err : out)
        << terminal::ForReading
        << measure::SummaryText(*diagnosis,
                                {input->cell, arguments.certificate_details.tolerance_m,
                                 written ? NextStep(arguments, *diagnosis) : "", arguments.details})
        << std::flush;
  }
  const auto missing = [&](const std::string& path, const std::string& option) {
    return !path.empty() && std::none_of(outputs.begin(), outputs.end(), [&](const auto& output) {
      return output.option == option;
    });
  };
  if (missing(arguments.model, "--write-model") || missing(arguments.arm_out, "--arm-out"))
    return kExitFault;
  return written && !missing(arguments.pdf, "--pdf") ? kExitOk : kExitUsage;
}

void AddDiagnoseCommand(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<DiagnoseArguments>();
  CLI::App* command =
      app.add_subcommand("diagnose", "Find the effects that a cell lacks, from measured points");
  command->add_option("cell", arguments->cell, "Declared model, CELL.toml")->required();
  command->add_option("measured", arguments->measured, "Measured points, MEASURED.csv")->required();
  command->add_option("--json", arguments->json, "Write the result as JSON; - is standard output");
  command->add_option("--write-model", arguments->model,
                      "Write the corrected cell: CELL.toml with the found effects appended");
  command->add_option("--report", arguments->report,
                      "Write a report: one self-contained HTML file (plots require gnuplot)");
  command->add_option("--pdf", arguments->pdf,
                      "Write the report as PDF, certificate on page 1 (requires weasyprint)");
  command
      ->add_option_function<double>(
          "--tolerance-mm",
          [arguments](double tolerance_mm) {
            arguments->certificate_details.tolerance_m = kMetrePerMm * tolerance_mm;
          },
          "Largest permitted error of a measured pose: shown, and for the report's statement of\n"
          "conformity "
          "(ISO 14253-1: the expanded uncertainty counts against conformity)")
      ->check(NumberWithin(1e-4, 1e3));
  for (const DetailOption& option : kDetailOptions) {
    command->add_option(option.name, arguments->certificate_details.*option.text,
                        fmt::format("For the report: {}", option.help));
  }
  command->add_option("--next-poses", arguments->next_poses,
                      "Write poses that would separate rival explanations, a CSV file\n"
                      "(default: next_poses.csv beside the --json file)");
  command
      ->add_option_function<std::string>(
          "--time-zero",
          [arguments](const std::string& text) {
            arguments->time_zero_s = text::UtcFromText(text);
          },
          "UTC time at which t_s of the rows is 0, e.g. 2026-11-21T07:30:00Z; the daemon needs it "
          "to\n"
          "apply an effect of time (`plumbline journal export` prints it)")
      ->check([](const std::string& text) {
        return text::UtcFromText(text) ? ""
                                       : text + " is not a UTC time such as 2026-11-21T07:30:00Z";
      });
  command->add_flag(
      "--order-unknown", arguments->order_unknown,
      "The robot made other moves between the rows, as between probes of a running\n"
      "cell: effects of the last move (approach lag, backlash by move) are not considered");
  CLI::Option* siblings = command->add_option(
      "--siblings", arguments->siblings,
      "Folders of other arms of the same model, each with its cell.toml and measured.csv:\n"
      "what at least two of them have in common is the starting point, if these rows\n"
      "confirm it");
  siblings->check(CLI::ExistingDirectory);
  CLI::Option* prior =
      command
          ->add_option("--prior", arguments->prior,
                       "Signed prior of the arm's model, a file or a folder of *.prior: what the "
                       "plant's\narms of this model have in common; used if [robot] model names "
                       "the model\nand these rows confirm it")
          ->capture_default_str()
          ->excludes(siblings);
  command
      ->add_option("--prior-keys", arguments->prior_keys,
                   "Folder of the plant's public keys, *.pem")
      ->capture_default_str();
  command
      ->add_flag_callback(
          "--no-prior", [arguments] { arguments->prior.clear(); }, "Use no prior")
      ->excludes(prior);
  command
      ->add_option(
          "--arm-out", arguments->arm_out,
          "Write what `plumbline prior` needs of this arm, a JSON file; no prior is used, and "
          "[[effect]] of\nthe cell file are ignored: the arm is diagnosed as declared")
      ->excludes(prior);
  command->add_option("--arm-name", arguments->arm_name,
                      "Name of the arm in that file (default: [robot] name)");
  command->add_option("--threads", arguments->threads, "Number of threads")
      ->capture_default_str()
      ->check(WholeNumberWithin(1, 256));
  command->add_flag("--details", arguments->details,
                    "Print every value, rival, doubt and note, and what was not recorded");
  command->add_flag("--quiet", arguments->quiet, "Print neither summary nor progress");
  command->footer(
      "MEASURED.csv has a header row with q1_deg.. qn_deg and x_mm,y_mm,z_mm (or range_mm), and\n"
      "optionally session, t_s, payload_kg, temp_C, qd1_deg_s.., qdd1_deg_s2.., tau1_Nm.. and any\n"
      "other recorded signal. The rows are in order of execution. A missing column counts as not\n"
      "recorded.\n\n"
      "Examples:\n"
      "  plumbline diagnose cell.toml measured.csv\n"
      "  plumbline diagnose cell.toml measured.csv --write-model corrected.toml \\\n"
      "      --report report.html\n"
      "  plumbline diagnose cell.toml measured.csv --pdf certificate.pdf \\\n"
      "      --tolerance-mm 0.5 --robot-serial 871 \\\n"
      "      --instrument \"laser tracker\" --serial 1234\n"
      "  plumbline diagnose cell.toml measured.csv --siblings arm-2 arm-3 arm-4\n"
      "  plumbline diagnose cell.toml measured.csv --prior kr210.prior --prior-keys .\n"
      "  plumbline diagnose cell.toml measured.csv --quiet --json - | jq .verdict\n\n"
      "Exit codes: 0 the diagnosis finished, whatever its verdict; 1 the input has faults or\n"
      "cannot be read, or the corrected model would not be a valid cell; 2 wrong arguments,\n"
      "or a file cannot be written; 130 interrupted, no file was changed.");
  command->callback([arguments, &exit_code] {
    exit_code = RunDiagnose(*arguments, measure::Diagnose, std::cout, std::cerr);
  });
}

}  // namespace plumbline::cli
