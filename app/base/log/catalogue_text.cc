#include "app/base/log/catalogue_text.h"

#include <fmt/format.h>

#include <string_view>

#include "app/base/log/event.h"
#include "app/base/log/level_text.h"
#include "app/base/text/json_text.h"

namespace plumbline::log {
namespace {

/// Heading of a component's table.
std::string_view TitleOf(std::string_view component) {
  return component == "service"      ? "Start, stop and the machine"
         : component == "robot"      ? "Robot"
         : component == "motion"     ? "Corrections inside the motion"
         : component == "points"     ? "Points"
         : component == "plc"        ? "PLC"
         : component == "monitoring" ? "Probes and models"
         : component == "camera"     ? "Camera and lens"
         : component == "display"    ? "Display and page"
         : component == "sparkplug"  ? "Sparkplug bridge"
                                     : "Plant broker";
}

}  // namespace

std::string JournalCatalogue() {
  std::string text = "# What Plumbline's log entries mean: journalctl --catalog -u plumbline\n";
  for (const EventEntry& entry : EventCatalogue()) {
    text += fmt::format(
        "\n-- {}\nSubject: {}\nDefined-By: Plumbline\nDocumentation: man:plumblined(8)\n\n",
        entry.id, entry.name);
    text += "@MESSAGE@\n";
    if (*entry.means != '\0') text += fmt::format("\nWhat it means: {}\n", entry.means);
    if (*entry.remedy != '\0') text += fmt::format("\nWhat to do: {}\n", entry.remedy);
  }
  return text;
}

std::string EventTables() {
  std::string text;
  std::string_view component;
  for (const EventEntry& entry : EventCatalogue()) {
    if (component != entry.component) {
      component = entry.component;
      text += fmt::format("{}## {}\n\n| event | line | means | do |\n|---|---|---|---|\n",
                          text.empty() ? "" : "\n", TitleOf(component));
    }
    text +=
        fmt::format("| `{}` | {} | {} | {} |\n", entry.name, entry.line, entry.means, entry.remedy);
  }
  return text;
}

std::string EventsJson() {
  nlohmann::ordered_json events = nlohmann::ordered_json::array();
  for (const EventEntry& entry : EventCatalogue()) {
    events.push_back({{"event", entry.name},
                      {"level", LevelText(entry.level)},
                      {"id", entry.id},
                      {"component", entry.component},
                      {"line", entry.line},
                      {"means", entry.means},
                      {"do", entry.remedy}});
  }
  return text::JsonText(events, 1) + "\n";
}

}  // namespace plumbline::log
