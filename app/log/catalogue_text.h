// The catalogue of events as others read it.
#pragma once

#include <string>

namespace plumbline {

/// As journalctl --catalog reads it (systemd's "Journal Message Catalogs").
std::string JournalCatalogue();

/// The tables of the manual, one a component.
std::string EventTables();

/// An array of objects: event, level, id, component, line, means, do.
std::string EventsJson();

}  // namespace plumbline
