#include "app/cli/log_command.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/cli/exit_codes.h"
#include "app/cli/failure.h"
#include "app/cli/interruption.h"
#include "app/cli/number_option.h"
#include "app/config/utc_text.h"
#include "app/log/catalogue_text.h"
#include "app/log/journal_reader.h"
#include "app/log/level_text.h"
#include "app/service/utc_clock.h"

namespace plumbline {
namespace {

constexpr double kFollowWait_s = 0.5;

struct LogOptions {
  JournalQuery query;
  std::string since, level;
  bool follow = false, explain = false, json = false;
  bool events = false, tables = false, catalogue = false;
};

/// "15m", "2h", "3d", "90s" before now, or a time in UTC.
std::optional<double> SinceFromText(const std::string& text) {
  if (const auto utc_s = UtcFromText(text)) return utc_s;
  if (text.size() < 2) return {};
  const auto count = FiniteNumberFromText(text.substr(0, text.size() - 1));
  const char unit = text.back();
  const double unit_s = unit == 's'   ? 1
                        : unit == 'm' ? 60
                        : unit == 'h' ? 3600
                        : unit == 'd' ? 86400
                                      : 0;
  if (!count || *count < 0 || unit_s == 0) return {};
  return ComputerUtcSeconds() - *count * unit_s;
}

std::string LocalTime(double utc_s) {
  return fmt::format("{:%Y-%m-%d %H:%M:%S}", fmt::localtime(static_cast<std::time_t>(utc_s)));
}

std::string LevelOf(const KeptEntry& entry) {
  return LevelText(static_cast<LogLevel>(std::clamp(entry.priority, 3, 6)));
}

std::string KeptText(const KeptEntry& entry, bool explain) {
  std::string text =
      fmt::format("{}  {:<7}  {}\n", LocalTime(entry.utc_s), LevelOf(entry), entry.text);
  const EventEntry* const kind = explain ? FindEvent(entry.event) : nullptr;
  if (kind == nullptr) return text;
  if (*kind->means != '\0') text += fmt::format("{:>31}  {}\n", "means:", kind->means);
  if (*kind->remedy != '\0') text += fmt::format("{:>31}  {}\n", "do:", kind->remedy);
  return text;
}

std::string KeptJson(const KeptEntry& entry) {
  nlohmann::ordered_json line = {
      {"time_utc", TextFromUtc(entry.utc_s)}, {"level", LevelOf(entry)}, {"event", entry.event},
      {"component", entry.component},         {"cell", entry.cell},      {"text", entry.text}};
  nlohmann::ordered_json fields = nlohmann::ordered_json::object();
  for (const LogField& field : entry.fields) fields[field.name] = field.value;
  line["fields"] = fields;
  return line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

/// Of one who may not read the journal, it has no entries.
constexpr const char* kNothingKept =
    "the journal has no such entry of plumblined that you may read: a member of the group "
    "systemd-journal may read all (sudo plumbline log); a daemon that was not started by systemd "
    "logs on its standard error\n";

int PrintJournal(const LogOptions& options) {
  const Interruption interruption;
  Result<JournalReader> reader = JournalReader::Open(options.query);
  if (!reader) return Fail(reader.error());
  bool any = false;
  while (!Interruption::Asked()) {
    const auto entry = reader.value().Next();
    if (entry) {
      any = true;
      std::cout << (options.json ? KeptJson(*entry) : KeptText(*entry, options.explain));
      continue;
    }
    if (!options.follow) break;
    std::cout.flush();
    if (!std::cout) break;
    reader.value().Wait(kFollowWait_s);
  }
  if (!any && !options.follow) std::cerr << kNothingKept;
  return kExitOk;
}

std::string EventList() {
  std::string text = fmt::format("{:<24} {:<8} {:<10} {}\n", "event", "level", "component", "line");
  for (const EventEntry& entry : EventCatalogue()) {
    text += fmt::format("{:<24} {:<8} {:<10} {}\n", entry.name, LevelText(entry.level),
                        entry.component, entry.line);
  }
  return text;
}

std::string EventText(const EventEntry& entry) {
  std::string text = fmt::format("{} ({}, {}): {}\n", entry.name, LevelText(entry.level),
                                 entry.component, entry.line);
  if (*entry.means != '\0') text += fmt::format("  means: {}\n", entry.means);
  if (*entry.remedy != '\0') text += fmt::format("  do:    {}\n", entry.remedy);
  return text;
}

int PrintEvents(const LogOptions& options) {
  const EventEntry* const one = FindEvent(options.query.event);
  std::cout << (options.tables      ? EventTables()
                : options.catalogue ? JournalCatalogue()
                : options.json      ? EventsJson()
                : one != nullptr    ? EventText(*one)
                                    : EventList());
  return kExitOk;
}

int RunLog(LogOptions options) {
  if (!options.query.event.empty() && FindEvent(options.query.event) == nullptr) {
    return Fail(fmt::format("plumbline log: no event \"{}\"; plumbline log --events lists them",
                            options.query.event),
                kExitUsage);
  }
  if (options.events || options.tables || options.catalogue) return PrintEvents(options);
  if (!options.since.empty()) {
    options.query.since_utc_s = SinceFromText(options.since);
    if (!options.query.since_utc_s) {
      return Fail(
          fmt::format("plumbline log: --since {}: neither a while such as 15m, 2h, 3d nor a "
                      "time such as 2026-11-21T07:30:00Z",
                      options.since),
          kExitUsage);
    }
  }
  if (!options.level.empty()) options.query.level = LevelFromText(options.level);
  return PrintJournal(options);
}

}  // namespace

void AddLogCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<LogOptions>();
  CLI::App* log = app.add_subcommand("log", "What happened: the daemon's and the monitor's log");
  log->add_option("-n,--last", options->query.last, "At most so many entries, the newest")
      ->capture_default_str()
      ->check(WholeNumberWithin(1, 1000000));
  log->add_option("--since", options->since, "From then on: 90s, 15m, 2h, 3d ago, or a UTC time");
  log->add_option("--level", options->level, "This level and graver ones")
      ->check(CLI::IsMember({"error", "warning", "notice", "info"}));
  log->add_option("--event", options->query.event, "Of this event alone");
  log->add_flag("-f,--follow", options->follow, "Goes on until Ctrl-C");
  log->add_flag("-x,--explain", options->explain, "Under each what it means and what to do");
  log->add_flag("--json", options->json, "A JSON object a line, with the values");
  log->add_flag("--events", options->events,
                "Lists what can happen instead; with --event that one, explained");
  log->add_option("--directory", options->query.directory,
                  "Journal files of another computer, in place of this one's journal");
  log->add_flag("--tables", options->tables, "The manual's tables of events")->group("");
  log->add_flag("--catalogue", options->catalogue, "The catalogue for journalctl")->group("");
  log->footer(
      "Examples:\n  plumbline log --since 2h --level warning --explain\n"
      "  plumbline log --event robot-link-lost --json\n"
      "  plumbline log --events --event drift-alarm\n\n"
      "Exit codes: 0 printed (also where nothing is kept, which is told), 1 the journal cannot be\n"
      "read, 2 wrong arguments.");
  log->callback([options, &exit_code] { exit_code = RunLog(*options); });
}

}  // namespace plumbline
