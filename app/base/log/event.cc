#include "app/base/log/event.h"

#include <algorithm>
#include <vector>

#include "app/base/log/catalogue_parts.h"

namespace plumbline::log {

std::span<const EventEntry> EventCatalogue() {
  static const std::vector<EventEntry> entries = [] {
    const auto daemon = DaemonEvents(), camera = CameraEvents(), fleet = FleetEvents(),
               sparkplug = SparkplugEvents();
    std::vector<EventEntry> all(daemon.begin(), daemon.end());
    all.insert(all.end(), camera.begin(), camera.end());
    all.insert(all.end(), fleet.begin(), fleet.end());
    all.insert(all.end(), sparkplug.begin(), sparkplug.end());
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
