// Log entry: an event with its text and values, and its journald encoding.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "app/base/log/event.h"

namespace plumbline::log {

/// A value for filtering and counting: PLUMBLINE_<name> in the journal. The name consists of
/// capitals, digits and underscores, and ends with the unit.
struct LogField {
  std::string name, value;
};

struct LogEntry {
  Event event;
  std::string text;
  std::vector<LogField> fields = {};
};

/// Receiver of log entries, for code that may run without the process-wide log.
using LogSink = std::function<void(const LogEntry&)>;

/// Fields of every entry; those that are empty or 0 are left out.
struct LogContext {
  std::string cell;  ///< name of the arm
  int model_version = 0;
};

/// The entry's journald fields, "NAME=value" each: MESSAGE, PRIORITY, MESSAGE_ID,
/// SYSLOG_IDENTIFIER, PLUMBLINE_EVENT, _COMPONENT, _CELL, _MODEL_VERSION and the entry's own
/// fields. A field whose name journald would refuse is left out.
std::vector<std::string> JournalFields(const LogEntry& entry, const LogContext& context,
                                       const char* program);

/// The fields as one datagram of journald's native protocol (systemd's
/// docs/JOURNAL_NATIVE_PROTOCOL.md): "NAME=value\n", or for a value that contains line breaks
/// "NAME\n", its length as 64 bits, little endian, the value, "\n".
std::string JournalDatagram(const std::vector<std::string>& fields);

}  // namespace plumbline::log
