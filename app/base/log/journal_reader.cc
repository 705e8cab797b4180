#include "app/base/log/journal_reader.h"

#include <fmt/format.h>
#include <systemd/sd-journal.h>

#include <cstring>
#include <string_view>

#include "drivers/files/open_failure.h"

namespace plumbline::log {
namespace {

constexpr std::string_view kPrefix = "PLUMBLINE_";

void Match(sd_journal* journal, const std::string& match) {
  sd_journal_add_match(journal, match.data(), match.size());
}

/// journald ORs matches of the same field and ANDs matches of different fields.
void AddMatches(sd_journal* journal, const JournalQuery& query) {
  for (const char* program :
       {"plumblined", "plumbline-view", "plumbline-fleet", "plumbline-sparkplug"}) {
    Match(journal, fmt::format("SYSLOG_IDENTIFIER={}", program));
  }
  if (!query.event.empty()) Match(journal, "PLUMBLINE_EVENT=" + query.event);
  if (!query.level) return;
  for (int level = 0; level <= static_cast<int>(*query.level); ++level) {
    Match(journal, fmt::format("PRIORITY={}", level));
  }
}

/// Moves to just before the first entry that the query asks for.
int Seek(sd_journal* journal, const JournalQuery& query) {
  if (const int failed = sd_journal_seek_tail(journal); failed < 0) return failed;
  for (std::size_t k = 0; k <= query.last; ++k) {
    const int moved = sd_journal_previous(journal);
    if (moved < 0) return moved;
    if (moved == 0) return sd_journal_seek_head(journal);
    std::uint64_t usec = 0;
    sd_journal_get_realtime_usec(journal, &usec);
    if (query.since_utc_s && 1e-6 * static_cast<double>(usec) < *query.since_utc_s) break;
  }
  return 0;
}

void AddField(std::string_view field, StoredLogEntry& entry) {
  const auto equals = field.find('=');
  if (equals == std::string_view::npos) return;
  const std::string_view name = field.substr(0, equals);
  const std::string value(field.substr(equals + 1));
  if (name == "MESSAGE") {
    entry.text = value;
  } else if (name == "PRIORITY" && value.size() == 1 && value[0] >= '0' && value[0] <= '7') {
    entry.priority = value[0] - '0';
  } else if (name == "PLUMBLINE_EVENT") {
    entry.event = value;
  } else if (name == "PLUMBLINE_COMPONENT") {
    entry.component = value;
  } else if (name == "PLUMBLINE_CELL") {
    entry.cell = value;
  } else if (name.substr(0, kPrefix.size()) == kPrefix) {
    entry.fields.push_back({std::string(name.substr(kPrefix.size())), value});
  }
}

}  // namespace

void JournalReader::Close::operator()(sd_journal* journal) const {
  sd_journal_close(journal);
}

Result<JournalReader> JournalReader::Open(const JournalQuery& query) {
  sd_journal* opened = nullptr;
  const int failed = query.directory.empty()
                         ? sd_journal_open(&opened, SD_JOURNAL_LOCAL_ONLY)
                         : sd_journal_open_directory(&opened, query.directory.c_str(), 0);
  const std::string where = query.directory.empty() ? "the journal" : query.directory;
  if (failed < 0) {
    return Error{fmt::format("{}: {}{}", where, std::strerror(-failed),
                             query.directory.empty() ? "" : files::ReadRemedy(query.directory))};
  }
  JournalReader reader;
  reader.journal_.reset(opened);
  AddMatches(opened, query);
  if (const int missed = Seek(opened, query); missed < 0) {
    return Error{fmt::format("{}: {}", where, std::strerror(-missed))};
  }
  return reader;
}

std::optional<StoredLogEntry> JournalReader::Next() {
  sd_journal* const journal = journal_.get();
  if (sd_journal_next(journal) <= 0) return {};
  StoredLogEntry entry;
  std::uint64_t usec = 0;
  if (sd_journal_get_realtime_usec(journal, &usec) >= 0) {
    entry.utc_s = 1e-6 * static_cast<double>(usec);
  }
  const void* data = nullptr;
  std::size_t size = 0;
  while (sd_journal_enumerate_available_data(journal, &data, &size) > 0) {
    AddField({static_cast<const char*>(data), size}, entry);
  }
  return entry;
}

void JournalReader::Wait(double seconds) {
  sd_journal_wait(journal_.get(), static_cast<std::uint64_t>(1e6 * seconds));
}

}  // namespace plumbline::log
