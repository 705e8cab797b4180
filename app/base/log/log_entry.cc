#include "app/base/log/log_entry.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

namespace plumbline::log {
namespace {

/// Whether journald accepts "PLUMBLINE_" + `name` as a field name [sd_journal_send(3)].
bool IsFieldName(const std::string& name) {
  constexpr std::size_t kLongest = 64 - sizeof "PLUMBLINE_" + 1;
  return !name.empty() && name.size() <= kLongest &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
         });
}

}  // namespace

std::vector<std::string> JournalFields(const LogEntry& entry, const LogContext& context,
                                       const char* program) {
  const EventEntry& kind = EntryOf(entry.event);
  std::vector<std::string> fields = {
      "MESSAGE=" + entry.text,
      fmt::format("PRIORITY={}", static_cast<int>(kind.level)),
      fmt::format("MESSAGE_ID={}", kind.id),
      fmt::format("SYSLOG_IDENTIFIER={}", program),
      fmt::format("PLUMBLINE_EVENT={}", kind.name),
  };
  fields.push_back(fmt::format("PLUMBLINE_COMPONENT={}", kind.component));
  if (!context.cell.empty()) fields.push_back("PLUMBLINE_CELL=" + context.cell);
  if (context.model_version > 0) {
    fields.push_back(fmt::format("PLUMBLINE_MODEL_VERSION={}", context.model_version));
  }
  for (const LogField& field : entry.fields) {
    if (IsFieldName(field.name)) {
      fields.push_back(fmt::format("PLUMBLINE_{}={}", field.name, field.value));
    }
  }
  return fields;
}

std::string JournalDatagram(const std::vector<std::string>& fields) {
  std::string datagram;
  for (const std::string& field : fields) {
    const std::size_t equals = field.find('=');
    if (equals == std::string::npos || field.find('\n') == std::string::npos) {
      datagram += field + '\n';
      continue;
    }
    datagram += field.substr(0, equals) + '\n';
    const std::uint64_t length = field.size() - equals - 1;
    for (int byte = 0; byte < 8; ++byte) datagram += static_cast<char>(length >> (8 * byte));
    datagram += field.substr(equals + 1) + '\n';
  }
  return datagram;
}

}  // namespace plumbline::log
