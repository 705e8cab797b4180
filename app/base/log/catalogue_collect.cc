#include "app/base/log/catalogue_parts.h"

namespace plumbline::log {
namespace {

constexpr EventEntry kCollectEntries[] = {
    {Event::kCollectStarted, "collect-started", LogLevel::kNotice,
     "76a6b65d9819df64d93cd46051191f68", "collect", "plumbline-collect ..., collector NAME",
     "messages of the cells are stored from now on", ""},
    {Event::kCollectNotStarted, "collect-not-started", LogLevel::kError,
     "e73cba776a9537c18d750e97943cdec2", "collect", "FILE is not used: ...",
     "the configuration has the faults logged before this line; a running collector keeps the "
     "previous one",
     "fix what the lines name and start again"},
    {Event::kCollectBrokerUp, "collect-broker-up", LogLevel::kNotice,
     "6f65805d7aac97ad99afb3a6594babc8", "collect", "broker ... connected; ...",
     "the cells' messages arrive. `it had kept nothing` is normal at the first connection under "
     "this name; later it means that the broker has lost its sessions",
     "lost sessions: check `persistence` of the broker; `plumbline plant status` shows whether "
     "messages are missing"},
    {Event::kCollectBrokerLost, "collect-broker-lost", LogLevel::kWarning,
     "520ca9b42c0dffcd4fa8a0f3610dd703", "collect", "broker ...: ...",
     "not connected; the line says why. The broker, or the cells, keep the messages",
     "check network, host and port. Not authorised: username, password file, and the broker's "
     "access list. TLS: `tls_ca`, and the host name as in the broker's certificate"},
    {Event::kCollectDatabaseUp, "collect-database-up", LogLevel::kNotice,
     "068f460ccf8907ad7d98528a2a6d9df9", "collect", "database connected", "", ""},
    {Event::kCollectDatabaseLost, "collect-database-lost", LogLevel::kWarning,
     "a40ab2a71e33a09e435d2b8befc86036", "collect",
     "database: ...; messages stay at the broker meanwhile",
     "the last messages were not acknowledged, and the broker repeats them",
     "as the line says; after an update `plumbline plant init`. Disk full: free space, or a "
     "smaller `retention_months`"},
    {Event::kCollectDeadLetters, "collect-dead-letters", LogLevel::kWarning,
     "6344a4099dc44861ccce1836a85ed9b5", "collect", "N messages could not be read; ...",
     "a publisher sends what is not a message of plumbline-fleet, a newer version of it, or a "
     "cell's clock is wrong",
     "`plumbline plant status` shows topic and reason"},
    {Event::kCollectRefused, "collect-refused", LogLevel::kWarning,
     "cb4a73924b83572a36a5432dbac6982b", "collect", "N messages were refused ...",
     "a cell sends more than `messages_per_second` or `messages_per_day`; the others are not "
     "affected",
     "find the cause at the cell that `plumbline plant status` names; it may have to be removed "
     "from the broker's access list"},
    {Event::kCollectRetention, "collect-retention", LogLevel::kWarning,
     "7889626af990e1c9c27b32e124b93dd5", "collect", "old messages are not deleted: ...",
     "messages older than `retention_months` stay until it works, and the partitions of the next "
     "month are not made ahead of time; it is tried again every six hours",
     "as the line says; a lock: a long query or backup of the database"},
};

}  // namespace

std::span<const EventEntry> CollectEvents() {
  return kCollectEntries;
}

}  // namespace plumbline::log
