#include <fmt/format.h>

#include <iostream>

#include "app/base/terminal/terminal_output.h"
#include "app/plant/answers/report_text.h"
#include "app/plant/commands/plant_commands.h"
#include "drivers/files/replace_file.h"

namespace plumbline::plant {
namespace {

struct ReportOptions : DatabaseOptions {
  int days = 30;
  std::string since, html;
  bool json = false;
};

int Report(const ReportOptions& options) {
  std::optional<int> since;
  if (!options.since.empty()) {
    since = DayFromText(options.since);
    if (!since) {
      std::cerr << fmt::format("--since {}: not a date; write it as 2026-11-30\n", options.since);
      return kExitUsage;
    }
  }
  auto connection = OpenDatabase(options);
  if (!connection) return kExitFault;
  const auto data = ReadReportData(*connection, options.days, since);
  if (!data) {
    std::cerr << fmt::format(
        "the plant's database did not answer: {}. Check that its user has the role "
        "plumbline_reader\n",
        data.error());
    return kExitFault;
  }
  const PlantReport report = ReportOf(*data);
  if (!options.html.empty()) {
    if (const auto written = files::ReplaceFile(options.html, ReportHtml(*data, report));
        !written) {
      std::cerr << fmt::format("{} was not written: {}\n", options.html, written.error());
      return kExitUsage;
    }
  }
  if (options.json) {
    std::cout << ReportJson(*data, report);
  } else if (options.html.empty()) {
    std::cout << terminal::ForReading << ReportText(*data, report);
  }
  return kExitOk;
}

}  // namespace

void AddReportCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<ReportOptions>();
  CLI::App* const command = app.add_subcommand(
      "report", "Worst and drifting cells, what differs by arm model, series and age");
  AddDatabaseOptions(*command, *options);
  command->add_option("--days", options->days, "Days until today, or before --since")
      ->check(CLI::Range(1, 400))
      ->capture_default_str();
  command->add_option("--since", options->since,
                      "Date of an event: compare the days after it with those before, and test for "
                      "drift after it");
  command->add_option("--html", options->html, "Write the report to this file");
  command->add_flag("--json", options->json, "Print JSON, with all cells");
  command->footer(
      "A cell is said to drift only if that is significant among all cells tested. Cells with too "
      "few days are counted, not judged. Needs the role plumbline_reader.\n\n"
      "Example:\n"
      "  plumbline plant report --since 2026-11-01  # what drifts since then\n\n"
      "Exit codes: 0 reported; 1 the database does not answer; 2 wrong arguments, or the file "
      "cannot "
      "be written.");
  command->callback([options, &exit_code] { exit_code = Report(*options); });
}

}  // namespace plumbline::plant
