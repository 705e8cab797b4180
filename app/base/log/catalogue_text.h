// Renderings of the event catalogue for journalctl, documents and programs.
#pragma once

#include <string>

namespace plumbline::log {

/// systemd message catalogue, for `journalctl --catalog` (systemd's "Journal Message Catalogs").
std::string JournalCatalogue();

/// The tables of docs/reference/log.md in Markdown, one for each component.
std::string EventTables();

/// JSON array of objects: event, level, id, component, line, means, do.
std::string EventsJson();

}  // namespace plumbline::log
