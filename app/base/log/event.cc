#include "app/base/log/event.h"

#include <algorithm>
#include <vector>

#include "app/base/log/catalogue_parts.h"

namespace plumbline::log {

std::span<const EventEntry> EventCatalogue() {
  static const std::vector<EventEntry> entries = [] {
    std::vector<EventEntry> all;
    for (const auto part : {DaemonEvents(), CameraEvents(), FleetEvents(), CollectEvents(),
                            SparkplugEvents(), WorkerEvents()}) {
      all.insert(all.end(), part.begin(), part.end());
    }
    return all;
  }();
  return entries;
}

const EventEntry& EntryOf(Event event) {
  return EventCatalogue()[static_cast<std::size_t>(event)];
}

const EventEntry* FindEvent(std::string_view name) {
  const auto entries = EventCatalogue();
  const auto found = std::find_if(entries.begin(), entries.end(),
                                  [&](const EventEntry& entry) { return entry.name == name; });
  return found == entries.end() ? nullptr : &*found;
}

}  // namespace plumbline::log
