// plumbline log: prints the log of the daemon and the display, and the event catalogue.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <iostream>
#include <memory>

#include "app/base/log/catalogue_text.h"
#include "app/base/log/journal_reader.h"
#include "app/base/log/level_text.h"
#include "app/base/service/utc_clock.h"
#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/base/text/text.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/number_option.h"
#include "app/cli/progress.h"

namespace plumbline::cli {
namespace {

constexpr double kFollowWait_s = 0.5;

struct LogOptions {
  log::JournalQuery query;
  std::string since, level;
  bool follow = false, explain = false, json = false;
  bool events = false, tables = false, catalogue = false;
};

/// UTC [s] of "15m", "2h", "3d" or "90s" ago, or of a UTC timestamp; nullopt for any other text.
std::optional<double> SinceFromText(const std::string& text) {
  if (const auto utc_s = text::UtcFromText(text)) return utc_s;
  if (text.size() < 2) return {};
  const auto count = FiniteNumberFromText(text.substr(0, text.size() - 1));
  const char unit = text.back();
  const double unit_s = unit == 's'   ? 1
                        : unit == 'm' ? 60
                        : unit == 'h' ? 3600
                        : unit == 'd' ? 86400
                                      : 0;
  if (!count || *count < 0 || unit_s == 0) return {};
  return service::SystemUtcSeconds() - *count * unit_s;
}

std::string LocalTime(double utc_s) {
  return fmt::format("{:%Y-%m-%d %H:%M:%S}", fmt::localtime(static_cast<std::time_t>(utc_s)));
}

std::string LevelOf(const log::StoredLogEntry& entry) {
  return log::LevelText(static_cast<log::LogLevel>(std::clamp(entry.priority, 3, 6)));
}

std::string KeptText(const log::StoredLogEntry& entry, bool explain, bool colours) {
  const std::string level = LevelOf(entry);
  const std::string padding(level.size() < 7 ? 7 - level.size() : 0, ' ');
  const std::string word =
      level == "error"     ? terminal::Painted(level, terminal::Tone::kFault, colours)
      : level == "warning" ? terminal::Painted(level, terminal::Tone::kWarning, colours)
                           : level;
  std::string text =
      fmt::format("{}  {}{}  {}\n", LocalTime(entry.utc_s), word, padding, entry.text);
  const log::EventEntry* const kind = explain ? log::FindEvent(entry.event) : nullptr;
  if (kind == nullptr) return text;
  if (*kind->means != '\0') text += fmt::format("{:>31}  {}\n", "means:", kind->means);
  if (*kind->remedy != '\0') text += fmt::format("{:>31}  {}\n", "do:", kind->remedy);
  return text;
}

std::string KeptJson(const log::StoredLogEntry& entry) {
  nlohmann::ordered_json line = {{"time_utc", text::TextFromUtc(entry.utc_s)},
                                 {"level", LevelOf(entry)},
                                 {"event", entry.event},
                                 {"component", entry.component},
                                 {"cell", entry.cell},
                                 {"text", entry.text}};
  nlohmann::ordered_json fields = nlohmann::ordered_json::object();
  for (const log::LogField& field : entry.fields) fields[field.name] = field.value;
  line["fields"] = fields;
  return text::JsonText(line) + "\n";
}

/// To a user without permission the journal appears empty.
constexpr const char* kNoEntries =
    "the journal has no matching entry that you may read. Reading all entries requires root (sudo "
    "plumbline log) or membership of the group systemd-journal. A daemon that was not started by "
    "systemd logs to its standard error instead\n";

int PrintJournal(const LogOptions& options) {
  const Interruption interruption;
  Result<log::JournalReader> reader = log::JournalReader::Open(options.query);
  if (!reader) return Fail(reader.error());
  bool any = false;
  if (!options.json) std::cout << terminal::ForReading;
  while (!Interruption::Requested()) {
    const auto entry = reader.value().Next();
    if (entry) {
      any = true;
      std::cout << (options.json
                        ? KeptJson(*entry)
                        : KeptText(*entry, options.explain, terminal::ShowsColours(std::cout)));
      continue;
    }
    if (!options.follow) break;
    std::cout.flush();
    if (!std::cout) break;
    reader.value().Wait(kFollowWait_s);
  }
  if (!any && !options.follow) std::cerr << kNoEntries;
  return kExitOk;
}

std::string EventList() {
  std::string text = fmt::format("{:<24} {:<8} {:<10} {}\n", "event", "level", "component", "line");
  for (const log::EventEntry& entry : log::EventCatalogue()) {
    text += fmt::format("{:<24} {:<8} {:<10} {}\n", entry.name, log::LevelText(entry.level),
                        entry.component, entry.line);
  }
  return text;
}

std::string EventText(const log::EventEntry& entry) {
  std::string text = fmt::format("{} ({}, {}): {}\n", entry.name, log::LevelText(entry.level),
                                 entry.component, entry.line);
  if (*entry.means != '\0') text += fmt::format("  means: {}\n", entry.means);
  if (*entry.remedy != '\0') text += fmt::format("  do:    {}\n", entry.remedy);
  return text;
}

int PrintEvents(const LogOptions& options) {
  const log::EventEntry* const one = log::FindEvent(options.query.event);
  if (!options.tables && !options.catalogue && !options.json) std::cout << terminal::ForReading;
  std::cout << (options.tables      ? log::EventTables()
                : options.catalogue ? log::JournalCatalogue()
                : options.json      ? log::EventsJson()
                : one != nullptr    ? EventText(*one)
                                    : EventList());
  return kExitOk;
}

int RunLog(LogOptions options) {
  if (!options.query.event.empty() && log::FindEvent(options.query.event) == nullptr) {
    return Fail(fmt::format("plumbline log: no event \"{}\"; `plumbline log --events` lists all",
                            options.query.event),
                kExitUsage);
  }
  if (options.events || options.tables || options.catalogue) return PrintEvents(options);
  if (!options.since.empty()) {
    options.query.since_utc_s = SinceFromText(options.since);
    if (!options.query.since_utc_s) {
      return Fail(
          fmt::format("plumbline log: --since {}: is neither a duration such as 15m, 2h, 3d nor a "
                      "time such as 2026-11-21T07:30:00Z",
                      options.since),
          kExitUsage);
    }
  }
  if (!options.level.empty()) options.query.level = log::LevelFromText(options.level);
  return PrintJournal(options);
}

}  // namespace

void AddLogCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<LogOptions>();
  CLI::App* log = app.add_subcommand("log", "Show the log of the daemon and the display");
  log->add_option("-n,--last", options->query.last, "Show at most the newest N entries")
      ->capture_default_str()
      ->check(WholeNumberWithin(1, 1000000));
  log->add_option("--since", options->since,
                  "Show entries since 90s, 15m, 2h, 3d ago, or since a UTC time");
  log->add_option("--level", options->level, "Show entries of this level and more severe ones")
      ->check(CLI::IsMember({"error", "warning", "notice", "info"}));
  log->add_option("--event", options->query.event, "Show only this event");
  log->add_flag("-f,--follow", options->follow, "Follow new entries until Ctrl-C");
  log->add_flag("-x,--explain", options->explain, "Explain what each entry means and what to do");
  log->add_flag("--json", options->json, "Print one JSON object per line, with all fields");
  log->add_flag("--events", options->events,
                "List all events that exist; with --event, explain that one");
  log->add_option("--directory", options->query.directory,
                  "Read journal files from this directory, e.g. of another computer");
  log->add_flag("--tables", options->tables, "Event tables in Markdown")->group("");
  log->add_flag("--catalogue", options->catalogue, "Message catalogue for journalctl")->group("");
  log->footer(
      "Examples:\n  plumbline log --since 2h --level warning --explain\n"
      "  plumbline log --event robot-link-lost --json\n"
      "  plumbline log --events --event drift-alarm\n\n"
      "Exit codes: 0 success (also without matching entries, with a message), 1 the journal cannot "
      "be\n"
      "read, 2 wrong arguments.");
  log->callback([options, &exit_code] { exit_code = RunLog(*options); });
}

}  // namespace plumbline::cli
