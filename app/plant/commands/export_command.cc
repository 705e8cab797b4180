#include <fmt/format.h>

#include <iostream>

#include "app/base/text/text.h"
#include "app/plant/commands/job_progress.h"
#include "app/plant/commands/plant_commands.h"
#include "app/plant/jobs/cell_data.h"
#include "drivers/files/text_file.h"

namespace plumbline::plant {
namespace {

struct ExportOptions {
  DatabaseOptions database;
  std::string cell, output, cell_output;
  RowSelection rows;
};

int ExportRows(const ExportOptions& options) {
  auto connection = OpenDatabase(options.database);
  if (!connection) return kExitFault;
  const auto cell = FindCell(*connection, options.cell);
  if (!cell) return FailCommand(cell.error());
  const auto file = ReadCellFile(*connection, *cell);
  if (!file) return FailCommand(file.error());
  const auto rows = ReadCellRows(*connection, *cell, file->toml, options.rows);
  if (!rows) return FailCommand(rows.error());
  for (const std::string& note : rows->notes) std::cerr << note << '\n';
  if (!WriteCommandOutput(options.output, rows->csv, "--output")) return kExitUsage;
  if (!options.cell_output.empty() &&
      !WriteCommandOutput(options.cell_output, file->toml, "--cell-output")) {
    return kExitUsage;
  }
  std::cerr << fmt::format(
      "{}: {} rows. For plumbline diagnose, give --time-zero {} and --order-unknown, because moves "
      "between probes are not recorded\n",
      options.output == "-" ? "standard output" : options.output, rows->rows,
      text::TextFromUtc(rows->time_zero_utc_s));
  return kExitOk;
}

}  // namespace

void AddExportCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App* const command =
      app.add_subcommand("export", "Write one cell's stored probes as measured.csv");
  AddDatabaseOptions(*command, options->database);
  command->add_option("cell", options->cell, "LINE/NODE, as in the cell's topics")->required();
  command
      ->add_option("--output", options->output, "Write the rows to this file; - is standard output")
      ->required();
  command->add_option("--cell-output", options->cell_output,
                      "Write the newest cell.toml that the cell has published");
  AddUtcOption(*command, "--since", options->rows.since, "Only rows from this UTC time or date on");
  AddUtcOption(*command, "--until", options->rows.until,
               "Only rows up to this UTC time, or before this date");
  command->add_option("--last", options->rows.last, "Only the newest N rows")
      ->check(CLI::Range(1, 10'000'000));
  command->add_option("--model", options->rows.model, "Only rows predicted by this model version");
  command->add_flag("--quarantined", options->rows.quarantined,
                    "Also probes that wait for a decision or were rejected");
  command->footer(
      "The columns are those of `plumbline journal export` on the cell.\n\n"
      "Example:\n"
      "  plumbline plant export line-2/cell-7 --last 500 --output cell-7.csv \\\n"
      "      --cell-output cell-7.toml\n\n"
      "Exit codes: 0 written; 1 no such cell or rows, or no database; 2 wrong arguments, or a "
      "file\n"
      "cannot be written.");
  command->callback([options, &exit_code] { exit_code = ExportRows(*options); });
}

}  // namespace plumbline::plant
