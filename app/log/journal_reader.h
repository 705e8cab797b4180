// What journald kept of the daemon and the monitor.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/log/log_entry.h"
#include "firmware-like/result.h"

struct sd_journal;

namespace plumbline {

struct JournalQuery {
  std::string directory;  ///< of journal files; empty: this computer's journal
  std::optional<double> since_utc_s;
  std::optional<LogLevel> level;  ///< this one and graver ones
  std::string event;              ///< name; empty: all
  std::size_t last = 50;          ///< at most so many, the newest
};

/// An entry as it was kept.
struct KeptEntry {
  double utc_s = 0;
  int priority = 6;  ///< of syslog(3)
  std::string text, event, component, cell;
  std::vector<LogField> fields;  ///< the further PLUMBLINE_ ones, without that prefix
};

class JournalReader {
 public:
  /// Error: no journal can be read, with what to do.
  static Result<JournalReader> Open(const JournalQuery& query);

  /// The next entry in order of time; nothing: none is there yet.
  std::optional<KeptEntry> Next();
  /// Waits for another entry, at most so long [s].
  void Wait(double seconds);

 private:
  struct Close {
    void operator()(sd_journal* journal) const;
  };
  std::unique_ptr<sd_journal, Close> journal_;
};

}  // namespace plumbline
