// Reader of the product's entries in the systemd journal.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/base/log/log_entry.h"
#include "firmware-like/result.h"

struct sd_journal;

namespace plumbline::log {

struct JournalQuery {
  std::string directory;  ///< of journal files; empty: this machine's journal
  std::optional<double> since_utc_s;
  std::optional<LogLevel> level;  ///< this level and more severe ones
  std::string event;              ///< name; empty: all
  std::size_t last = 50;          ///< at most this many, the newest
};

/// An entry read from the journal.
struct StoredLogEntry {
  double utc_s = 0;
  int priority = 6;  ///< of syslog(3)
  std::string text, event, component, cell;
  std::vector<LogField> fields;  ///< the other PLUMBLINE_ fields, without that prefix
};

class JournalReader {
 public:
  /// Opens the journal before the first entry that matches. Fails if no journal can be read; the
  /// error includes what to do.
  static Result<JournalReader> Open(const JournalQuery& query);

  /// The next entry in order of time; nullopt if there is none yet.
  std::optional<StoredLogEntry> Next();
  /// Waits for a new entry, at most `seconds`.
  void Wait(double seconds);

 private:
  struct Close {
    void operator()(sd_journal* journal) const;
  };
  std::unique_ptr<sd_journal, Close> journal_;
};

}  // namespace plumbline::log
