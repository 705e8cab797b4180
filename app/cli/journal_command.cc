// plumbline journal: import, export, display and quarantine of measured points.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <thread>

#include "app/base/config/cell_reader.h"
#include "app/base/config/daemon_config.h"
#include "app/base/config/required_file.h"
#include "app/base/config/toml_reader.h"
#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/base/text/text.h"
#include "app/cell/journal/journal.h"
#include "app/cell/journal/journal_csv.h"
#include "app/cell/journal/salvage.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/journal_rows.h"
#include "app/cli/number_option.h"
#include "app/cli/output_file.h"
#include "app/cli/state_subcommand.h"
#include "app/measure/diagnosis/data/observations.h"

namespace plumbline::cli {
namespace {

// `plumbline journal check` and `salvage`.

nlohmann::json RangesJson(const std::vector<cell::RowRange>& ranges) {
  nlohmann::json list = nlohmann::json::array();
  for (const cell::RowRange& range : ranges) list.push_back({range.first, range.last});
  return list;
}

void PrintRanges(const std::vector<cell::RowRange>& ranges, const char* what) {
  if (!ranges.empty()) std::cout << RowRangesText(ranges) << ' ' << what << '\n';
}

/// Prints what is damaged in a journal. @return the exit code
int CheckJournalFile(const std::string& file, bool json) {
  Result<cell::Journal> journal = cell::Journal::OpenForReading(file);
  if (!journal) return Fail(journal.error(), kExitFault);
  const cell::IntegrityReport report = journal.value().Check();
  const int code = report.intact() ? kExitOk : kExitFault;
  if (json) {
    std::cout << text::JsonText(nlohmann::json{{"intact", report.intact()},
                                               {"rows", report.rows},
                                               {"damaged", RangesJson(report.damaged)},
                                               {"missing", RangesJson(report.missing)},
                                               {"lost_earlier", RangesJson(report.lost)},
                                               {"other", report.other}},
                                1)
              << '\n';
    return code;
  }
  std::cout << terminal::ForReading << fmt::format("{}: {} rows intact\n", file, report.rows);
  PrintRanges(report.lost, "lost earlier, as a salvage recorded");
  PrintRanges(report.damaged, "DAMAGED: changed since written, or unreadable");
  PrintRanges(report.missing, "MISSING");
  for (const std::string& one : report.other) std::cout << "DAMAGED: " << one << '\n';
  if (!report.intact()) {
    std::cout << "No probe is recorded in this file. `plumbline journal salvage` saves the intact "
                 "rows in a new journal and keeps this file; or restore the backup.\n";
  }
  return code;
}

/// Saves the intact rows of a damaged journal in a new one. @return the exit code
int SalvageJournalFile(const std::string& file) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const Result<cell::Salvage> salvage = cell::SalvageJournal(
      file, std::chrono::duration_cast<std::chrono::milliseconds>(now).count());
  if (!salvage) return Fail(salvage.error(), kExitFault);
  std::cout << terminal::ForReading
            << fmt::format("{}: {} rows saved; the damaged file is now {}\n", file, salvage->saved,
                           salvage->damaged_file);
  PrintRanges(salvage->found.damaged, "lost: changed since written, or unreadable");
  PrintRanges(salvage->found.missing, "lost: missing");
  for (const std::string& one : salvage->found.other) std::cout << "damaged: " << one << '\n';
  for (const std::string& note : salvage->notes) std::cout << note << '\n';
  std::cout << "The new journal records which rows are lost. A running daemon uses it within a few "
               "seconds; take a new drift reference with command 8 if reference rows are lost.\n";
  return kExitOk;
}

constexpr std::int64_t kMaxRows = 1000000000;

struct JournalOptions {
  std::string state = config::kDefaultStateDirectory;
  std::string cell, file;
  std::optional<std::int64_t> after, last;
  std::optional<std::string> session;
  std::optional<int> model_version;
  bool skip_bad = false, again = false, json = false, once = false;
  std::vector<std::int64_t> ids;  ///< ids of quarantined rows

  std::string JournalFile() const { return state + "/journal.sqlite"; }
  cell::JournalFilter Filter(cell::JournalFilter::Rows rows) const {
    return {after, last, session, model_version, rows};
  }
};

int Import(const JournalOptions& options) {
  config::FaultList faults;
  const std::optional<model::CellModel> cell = config::ReadCell(options.cell, faults);
  const std::optional<std::string> text =
      config::ReadRequiredFile(options.file, faults, files::kTableSize);
  std::optional<measure::MeasuredTable> table;
  if (text && cell) table = measure::TableFromCsv(*text, options.file, cell->robot.joints, faults);
  std::cerr << config::FaultsText(faults);
  if (!table) return kExitFault;
  if (!table->recorded.position && !table->recorded.range && !table->recorded.artefact) {
    return Fail(options.file +
                    ": has neither x_mm, y_mm, z_mm nor range_mm nor artefact: no measured values",
                kExitFault);
  }
  const std::size_t bad = table->unreadable_lines.size();
  if (bad > 0 && !options.skip_bad) {
    return Fail(fmt::format("{}: {} of {} rows cannot be read; nothing was imported. Fix them, or "
                            "skip them with --skip-bad",
                            options.file, bad, bad + table->rows.size()),
                kExitFault);
  }
  if (table->rows.empty()) return Fail(options.file + ": has no rows", kExitFault);
  if (const auto observed = measure::ObservationsOf(*cell, *table); !observed) {
    return Fail(options.file + ": " + observed.error(), kExitFault);
  }
  if (table->unmeasured.size() > 0) {
    std::cerr << fmt::format("{}: {} rows without a measured point were skipped (first: line {})\n",
                             options.file, table->unmeasured.size(),
                             table->unmeasured.front().line);
  }
  for (const std::string& column : table->further) {
    std::cerr << fmt::format("{}: column {} is not stored in the journal\n", options.file, column);
  }
  std::vector<int> skipped = table->unreadable_lines;
  for (const measure::MeasuredRow& row : table->unmeasured) skipped.push_back(row.line);
  std::sort(skipped.begin(), skipped.end());
  skipped.erase(std::unique(skipped.begin(), skipped.end()), skipped.end());
  std::error_code ignored;  // opening the journal reports the error
  std::filesystem::create_directories(options.state, ignored);
  Result<cell::Journal> journal = cell::Journal::Open(options.JournalFile());
  if (!journal) return Fail(journal.error(), kExitUsage);
  const std::uint64_t hash = cell::ContentHash(*text);
  const Result<std::int64_t> last = journal.value().AppendImport(
      cell::JournalRowsFrom(*table), cell->robot.joints, options.file, hash, options.again);
  if (!last) {
    const auto before = journal.value().ImportedAs(hash);
    const bool twice = !options.again && before && before->has_value();
    return Fail(last.error(), twice ? kExitFault : kExitUsage);
  }
  const auto rows = static_cast<std::int64_t>(table->rows.size());
  if (options.json) {
    const nlohmann::json answer = {
        {"rows", rows}, {"first", *last - rows + 1}, {"last", *last}, {"skipped_lines", skipped}};
    std::cout << text::JsonText(answer, 1) << '\n';
  } else {
    std::cout << fmt::format("{} rows imported as {}..{}, {} skipped\n", rows, *last - rows + 1,
                             *last, skipped.size());
  }
  return kExitOk;
}

/// Opens the journal of an existing state directory for reading.
Result<cell::Journal> ExistingJournal(const JournalOptions& options) {
  std::error_code unknown;
  if (!std::filesystem::exists(options.JournalFile(), unknown)) {
    return Error{fmt::format(
        "{}: the journal does not exist yet; a daemon with [monitoring] creates it at its "
        "first start, and so does `plumbline journal import`. Or give another --state",
        options.JournalFile())};
  }
  return cell::Journal::OpenForReading(options.JournalFile());
}

int Export(const JournalOptions& options) {
  for (const std::string& input : {options.cell, options.JournalFile()}) {
    if (!SameFile(options.file, input)) continue;
    return Fail(
        fmt::format("plumbline journal export: --output would overwrite {}; choose another file",
                    input),
        kExitUsage);
  }
  config::FaultList faults;
  const std::optional<model::CellModel> cell = config::ReadCell(options.cell, faults);
  std::cerr << config::FaultsText(faults);
  if (!cell) return kExitFault;
  Result<cell::Journal> journal = ExistingJournal(options);
  if (!journal) return Fail(journal.error(), kExitFault);
  const auto rows = journal.value().Read(options.Filter(cell::JournalFilter::Rows::kMeasurements),
                                         cell->robot.joints);
  if (!rows) return Fail(rows.error(), kExitFault);
  const cell::ExportedCsv exported = cell::CsvFromJournal(*rows, cell->robot.joints);
  for (const std::string& note : exported.notes) std::cerr << note << '\n';
  if (exported.ids.empty()) {
    return Fail(
        "the journal has no such rows; nothing was written. Probes in quarantine are not exported: "
        "`plumbline journal quarantine list` shows them",
        kExitFault);
  }
  const bool to_output = options.file == "-";
  if (!PrintOrWriteOutput(options.file, exported.text, "--output")) return kExitUsage;
  std::cerr << fmt::format(
      "{}: {} rows. For plumbline diagnose, give --time-zero {} if the rows are probes, and "
      "--order-unknown, because moves between probes are not recorded\n",
      to_output ? "standard output" : options.file, exported.ids.size(),
      text::TextFromUtc(journal.value().EpochUtc_s()));
  return kExitOk;
}

/// Joints of unknown type; values are then in the units of the file.
std::vector<model::Joint> JointsAsRecorded(int count) {
  return std::vector<model::Joint>(static_cast<std::size_t>(count));
}

Result<std::int64_t> Print(cell::Journal& journal, const cell::JournalFilter& filter, bool json) {
  std::int64_t last = filter.after_id.value_or(0);
  const Result<int> joints = journal.JointCount();
  if (!joints) return joints.failure();
  const Result<void> shown =
      journal.ForEach(filter, JointsAsRecorded(*joints), [&](const cell::JournalRow& row) {
        std::cout << (json ? text::JsonText(JournalRowJson(row)) : JournalRowText(row)) << '\n';
        last = row.id;
      });
  if (!shown) return shown.failure();
  std::cout.flush();
  return last;
}

int Show(const JournalOptions& options) {
  Result<cell::Journal> journal = ExistingJournal(options);
  if (!journal) return Fail(journal.error(), kExitFault);
  if (!options.json) std::cout << JournalHeader();
  const Result<std::int64_t> last =
      Print(journal.value(), options.Filter(cell::JournalFilter::Rows::kAll), options.json);
  return last ? kExitOk : Fail(last.error(), kExitFault);
}

int Tail(const JournalOptions& options) {
  Result<cell::Journal> journal = ExistingJournal(options);
  if (!journal) return Fail(journal.error(), kExitFault);
  cell::JournalFilter filter = options.Filter(cell::JournalFilter::Rows::kAll);
  if (!filter.last) filter.last = 10;
  if (!options.json) std::cout << JournalHeader();
  for (;;) {
    const Result<std::int64_t> last = Print(journal.value(), filter, options.json);
    if (!last) return Fail(last.error(), kExitFault);
    if (options.once || !std::cout) return kExitOk;
    filter.after_id = *last;
    filter.last.reset();
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }
}

int CheckFile(const JournalOptions& options) {
  return CheckJournalFile(options.JournalFile(), options.json);
}

int SalvageFile(const JournalOptions& options) {
  return SalvageJournalFile(options.JournalFile());
}

int ListQuarantine(const JournalOptions& options) {
  Result<cell::Journal> journal = ExistingJournal(options);
  if (!journal) return Fail(journal.error(), kExitFault);
  const Result<std::int64_t> waiting = journal.value().Waiting();
  if (!waiting) return Fail(waiting.error(), kExitFault);
  if (*waiting == 0 && !options.json) {
    std::cout << "no probe is waiting for a decision\n";
    return kExitOk;
  }
  if (!options.json) std::cout << JournalHeader();
  const Result<std::int64_t> last =
      Print(journal.value(), options.Filter(cell::JournalFilter::Rows::kWaiting), options.json);
  return last ? kExitOk : Fail(last.error(), kExitFault);
}

int Decide(const JournalOptions& options, bool accept) {
  const Result<cell::Journal> existing = ExistingJournal(options);
  if (!existing) return Fail(existing.error(), kExitFault);
  Result<cell::Journal> journal = cell::Journal::Open(options.JournalFile());
  if (!journal) return Fail(journal.error(), kExitUsage);
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const Result<void> decided = journal.value().Decide(
      options.ids, accept, std::chrono::duration_cast<std::chrono::milliseconds>(now).count());
  if (!decided) return Fail(decided.error(), kExitFault);
  const Result<std::int64_t> waiting = journal.value().Waiting();
  if (!waiting) return Fail(waiting.error(), kExitFault);
  std::cout << terminal::ForReading
            << fmt::format(
                   "{} row{} {}, {} waiting for a decision; a running daemon updates within a few "
                   "seconds\n",
                   options.ids.size(), options.ids.size() == 1 ? "" : "s",
                   accept ? "accepted" : "rejected", *waiting);
  return kExitOk;
}

int Accept(const JournalOptions& options) {
  return Decide(options, true);
}

int Reject(const JournalOptions& options) {
  return Decide(options, false);
}

void AddFilter(CLI::App& command, JournalOptions& options) {
  command.add_option("--last", options.last, "Only the newest N rows")
      ->check(WholeNumberWithin(1, kMaxRows));
  command.add_option("--after", options.after, "Only rows with a larger row number");
  command.add_option("--session", options.session, "Only rows of this session, in any boot");
  command.add_option("--model", options.model_version, "Only rows predicted by this model version");
}

}  // namespace

void AddJournalCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<JournalOptions>();
  CLI::App* journal = app.add_subcommand("journal", "Import, export and show measured points");
  journal->require_subcommand(1);
  journal->footer(
      "The journal is the file journal.sqlite in the daemon's state_directory.\n\n"
      "Examples:\n  plumbline journal show --last 20\n"
      "  plumbline journal export --cell cell.toml --output measured.csv");
  const auto add_to = [&](CLI::App& parent, const char* name, const char* what,
                          int (*run)(const JournalOptions&), const char* footer) {
    return AddStateSubcommand(parent, name, what, options, run, footer, exit_code);
  };
  const auto add = [&](const char* name, const char* what, int (*run)(const JournalOptions&),
                       const char* footer) { return add_to(*journal, name, what, run, footer); };

  CLI::App* import = add(
      "import", "Import a measured.csv into the journal, all rows or none", Import,
      "Every row that cannot be read is reported with its line and the reason.\n\n"
      "Example:\n  plumbline journal import measured.csv --cell cell.toml --state ./state\n\n"
      "Exit codes: 0 imported, 1 faults in the input (nothing was imported), 2 wrong arguments or "
      "the\n"
      "journal cannot be written.");
  import->add_option("measured", options->file, "MEASURED.csv")->required();
  import->add_option("--cell", options->cell, "CELL.toml, for the number and types of joints")
      ->required();
  import->add_flag("--skip-bad", options->skip_bad, "Skip rows that cannot be read");
  import->add_flag("--again", options->again, "Import even if these rows were imported before");
  import->add_flag("--json", options->json, "Print JSON");

  CLI::App* out = add(
      "export", "Export rows of the journal as measured.csv", Export,
      "A column that only some of the rows have is omitted, with a message. Probes in quarantine "
      "are\n"
      "omitted until they are accepted.\n\n"
      "Example:\n  plumbline journal export --cell cell.toml --last 200 --output measured.csv\n\n"
      "Exit codes: 0 written, 1 faults in the cell, no journal or no such rows, 2 wrong "
      "arguments or\n"
      "unwritable output.");
  out->add_option("--cell", options->cell, "CELL.toml, for the number and types of joints")
      ->required();
  out->add_option("--output,--out", options->file, "CSV file to write; - is standard output")
      ->required();
  AddFilter(*out, *options);

  CLI::App* show = add("show", "Print rows of the journal", Show,
                       "Example:\n  plumbline journal show --last 20 --json\n\n"
                       "Exit codes: 0 printed, 1 no journal or rows that cannot be read, 2 wrong "
                       "arguments.");
  show->add_flag("--json", options->json, "Print one JSON object per line, in mm and degrees");
  AddFilter(*show, *options);

  CLI::App* tail = add("tail", "Print the newest rows and follow new ones", Tail,
                       "Example:\n  plumbline journal tail\n\n"
                       "Ctrl-C stops it. Exit codes as for `show`.");
  tail->add_flag("--json", options->json, "Print one JSON object per line, in mm and degrees");
  tail->add_flag("--once", options->once, "Do not wait for further rows");
  AddFilter(*tail, *options);

  CLI::App* check = add("check", "Check that every row is as it was written", CheckFile,
                        "Checks the structure of the file, a checksum of each row, and that no row "
                        "number is missing.\n"
                        "\n"
                        "Example:\n  plumbline journal check --state ./state\n\n"
                        "Exit codes: 0 intact, 1 damaged or no journal, 2 wrong arguments.");
  check->add_flag("--json", options->json, "Print JSON");
  add("salvage", "Save the intact rows of a damaged journal in a new one", SalvageFile,
      "The damaged file is kept beside the new one as journal.damaged-TIME.sqlite. The new "
      "journal\n"
      "keeps the row numbers and records which rows are lost.\n\n"
      "Example:\n  plumbline journal salvage --state ./state\n\n"
      "Exit codes: 0 saved, 1 intact, in use, or not readable at all (nothing was changed), 2 "
      "wrong\n"
      "arguments.");

  CLI::App* quarantine = journal->add_subcommand(
      "quarantine", "List, accept or reject probes that contradict the model");
  quarantine->require_subcommand(1);
  quarantine->footer(
      "A probe that deviates from the model by more than any plausible effect is recorded, but "
      "not\n"
      "used for the reference, drift detection or diagnosis until a person accepts it.\n\n"
      "Examples:\n  plumbline journal quarantine list\n"
      "  plumbline journal quarantine accept 812");
  CLI::App* list =
      add_to(*quarantine, "list", "List the probes that are waiting for a decision", ListQuarantine,
             "Example:\n  plumbline journal quarantine list\n\nExit codes as for `show`.");
  list->add_flag("--json", options->json, "Print one JSON object per line, in mm and degrees");
  AddFilter(*list, *options);
  const auto add_decision = [&](const char* name, const char* what,
                                int (*run)(const JournalOptions&), const char* footer) {
    CLI::App* command = add_to(*quarantine, name, what, run, footer);
    command->add_option("rows", options->ids, "Row numbers, as printed by `list`")
        ->required()
        ->check(WholeNumberWithin(1, kMaxRows));
  };
  add_decision("accept", "Use these probes as measurements, at their place in time", Accept,
               "The drift monitor of a running daemon then reads the journal again.\n\n"
               "Example:\n  plumbline journal quarantine accept 812 813\n\n"
               "Exit codes: 0 accepted, 1 no journal, or a row is not in quarantine (nothing was\n"
               "changed), 2 wrong arguments or the journal cannot be written.");
  add_decision("reject", "Exclude these probes permanently; they remain in the journal, marked",
               Reject,
               "Example:\n  plumbline journal quarantine reject 812 813\n\n"
               "Exit codes as for `accept`.");
}

}  // namespace plumbline::cli
