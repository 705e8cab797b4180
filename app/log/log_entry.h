// One thing that happened, and to what.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "app/log/event.h"

namespace plumbline {

/// A value for whoever filters or counts: PLUMBLINE_<name> in the journal. The name in capitals,
/// digits and underscores, with its unit at the end.
struct LogField {
  std::string name, value;
};

struct LogEntry {
  Event event;
  std::string text;
  std::vector<LogField> fields = {};
};

/// Where those that notice something tell it.
using LogSink = std::function<void(const LogEntry&)>;

/// What every entry is about; empty and 0: not told.
struct LogContext {
  std::string cell;  ///< name of the arm
  int model_version = 0;
};

/// The entry as journald takes it, "NAME=value" each: MESSAGE, PRIORITY, MESSAGE_ID,
/// SYSLOG_IDENTIFIER, PLUMBLINE_EVENT, _COMPONENT, _CELL, _MODEL_VERSION and the entry's own
/// fields. A field's name that journald would refuse is left out with its value.
std::vector<std::string> JournalFields(const LogEntry& entry, const LogContext& context,
                                       const char* program);

/// The fields as one datagram of journald's native protocol (systemd's
/// docs/JOURNAL_NATIVE_PROTOCOL.md): "NAME=value\n", or where the value has lines of its own
/// "NAME\n", its length as 64 bits, little endian, the value, "\n".
std::string JournalDatagram(const std::vector<std::string>& fields);

}  // namespace plumbline
