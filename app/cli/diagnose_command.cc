#include "app/cli/diagnose_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>

#include "app/base/terminal/terminal_output.h"
#include "app/base/text/utc_text.h"
#include "app/cli/diagnose_input.h"
#include "app/cli/diagnose_outputs.h"
#include "app/cli/exit_codes.h"
#include "app/cli/interruption.h"
#include "app/cli/number_option.h"
#include "app/cli/progress.h"
#include "app/measure/diagnosis/summary.h"
#include "app/measure/siblings/siblings.h"
#include "firmware-like/geometry/length.h"

namespace plumbline::cli {
namespace {

/// Runs the engine, with siblings if any are given.
Result<measure::Diagnosis> Diagnosed(const DiagnosisEngine& engine,
                                     const measure::DiagnosisOptions& options,
                                     DiagnoseInput& input) {
  if (input.siblings.empty()) return engine(input.cell, std::move(input.measured), options);
  return measure::DiagnoseWithSiblings(input.cell, input.measured, std::move(input.siblings),
                                       engine, options);
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

/// The first given option that only the report states; null if none is given.
const char* OptionForReport(const measure::CertificateDetails& details) {
  if (details.tolerance_m) return "--tolerance-mm";
  if (!details.instrument.empty()) return "--instrument";
  if (!details.serial.empty()) return "--serial";
  return details.approved_by.empty() ? nullptr : "--approved-by";
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
        << terminal::ForReading << measure::SummaryText(*diagnosis, input->cell) << std::flush;
  }
  const auto missing = [&](const std::string& path, const std::string& option) {
    return !path.empty() && std::none_of(outputs.begin(), outputs.end(), [&](const auto& output) {
      return output.option == option;
    });
  };
  if (missing(arguments.model, "--write-model")) return kExitFault;
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
          "Largest permitted error of a measured pose, for the report's statement of conformity\n"
          "(ISO 14253-1: the expanded uncertainty counts against conformity)")
      ->check(NumberWithin(1e-4, 1e3));
  command->add_option("--instrument", arguments->certificate_details.instrument,
                      "Measuring instrument, for the report");
  command->add_option("--serial", arguments->certificate_details.serial,
                      "Serial number of the instrument, for the report");
  command->add_option("--approved-by", arguments->certificate_details.approved_by,
                      "Who approves the report; without it, the report leaves a line to fill in");
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
  command
      ->add_option(
          "--siblings", arguments->siblings,
          "Folders of other arms of the same model, each with its cell.toml and measured.csv:\n"
          "what at least two of them have in common is the starting point, if these rows\n"
          "confirm it")
      ->check(CLI::ExistingDirectory);
  command->add_option("--threads", arguments->threads, "Number of threads")
      ->capture_default_str()
      ->check(WholeNumberWithin(1, 256));
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
      "      --tolerance-mm 0.5 --instrument \"laser tracker\" --serial 1234\n"
      "  plumbline diagnose cell.toml measured.csv --siblings arm-2 arm-3 arm-4\n"
      "  plumbline diagnose cell.toml measured.csv --quiet --json - | jq .verdict\n\n"
      "Exit codes: 0 the diagnosis finished, whatever its verdict; 1 the input has faults or\n"
      "cannot be read, or the corrected model would not be a valid cell; 2 wrong arguments,\n"
      "or a file cannot be written; 130 interrupted, no file was changed.");
  command->callback([arguments, &exit_code] {
    exit_code = RunDiagnose(*arguments, measure::Diagnose, std::cout, std::cerr);
  });
}

}  // namespace plumbline::cli
