#include "app/config/settings_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "app/config/daemon_settings.h"

namespace plumbline {
namespace {

/// A table of plumbline.toml with its keys.
struct SettingsTable {
  std::string_view header;   ///< "[robot]", "[[point]]"; empty: the keys before the first table
  std::string_view meaning;  ///< of the table as a whole
  std::vector<Setting> keys = {};

  bool active() const {
    return std::any_of(keys.begin(), keys.end(),
                       [](const Setting& setting) { return setting.meaning.active; });
  }
};

/// @param list  lists the keys to the Settings that it is given
template <typename List>
SettingsTable Listed(std::string_view header, std::string_view meaning, List list) {
  SettingsTable table{header, meaning};
  Settings keys(table.keys);
  list(keys);
  return table;
}

template <typename Config>
SettingsTable TableOf(std::string_view header, std::string_view meaning) {
  return Listed(header, meaning, [](Settings& keys) {
    Config config;
    ListKeys(keys, config);
  });
}

SettingsTable ZoomTable() {
  SettingsTable table{"[zoom]",
                      "or [camera.zoom], below its [[camera]]; without it: a lens without zoom"};
  const auto add = [&table](const char* key, const char* type, const char* range, const char* value,
                            const Meaning& meaning) {
    table.keys.push_back({key, type, range, value, meaning});
  };
  const char* const counts = "0..10000";
  add("kind", "word", R"("visca", "hid", "v4l2", "gpio", "replay", "none")", "",
      {.sentence = "what senses the zoom", .example = "\"visca\"", .required = true});
  add("device", "text", "", "",
      {"of \"visca\", with the next four; of \"v4l2\"", "\"/dev/serial/by-id/...\"",
       "that of [camera], if \"v4l2\""});
  add("baud", "integer", "9600, 38400", "9600", {});
  add("address", "integer", "1..7", "1", {});
  add("timeout_ms", "number", "10..10000", "100.0", {"of \"hid\" too"});
  add("optical_max_counts", "integer", "1..16777216", "16384",
      {"beyond it the zoom is digital, and nothing is calibrated"});
  add("profile", "text", "", "",
      {"of \"hid\": a file of profiles/zoom", "\"computar-lensconnect\""});
  add("serial", "text", "", "", {"of two equal devices", "\"A1\""});
  add("chip", "text", "", "", {"of \"gpio\", with the next three", "\"/dev/gpiochip0\""});
  add("line", "integer", "0..1023", "", {"", "4"});
  add("active_low", "true or false", "", "false", {});
  add("debounce_ms", "number", "0..1000", "5.0", {});
  add("file", "text", "", "", {"of \"replay\": t_s,zoom_counts,...", "\"zoom.csv\""});
  add("period_ms", "number", "10..1000", "100.0",
      {"from reading to reading", "", "50 except for \"visca\": 100"});
  add("zoom_band_counts", "integer", counts, "2", {"a smaller change is ignored"});
  add("focus_band_counts", "integer", counts, "4", {});
  add("settle_ms", "number", "0..60000", "300.0", {"how long the lens must have been at rest"});
  add("lost_after_ms", "number", "100..600000", "1000.0",
      {"without an answer the sensor is lost after this time"});
  add("verify_patience_s", "number", "0.1..600", "5.0", {"then the board is asked for"});
  return table;
}

SettingsTable RobotTable() {
  return Listed("[robot]", "where the joints and the payload come from", [](Settings& keys) {
    RobotLinkConfig robot;
    PlausibilityLimits limits;
    ListKeys(keys, robot);
    ListKeys(keys, limits);
  });
}

SettingsTable PushTable() {
  return Listed("[push]",
                "corrected points written into the controller's registers; withdrawn when the "
                "daemon stops",
                [](Settings& keys) {
                  PushLimits push;
                  std::vector<int> ids;
                  ListKeys(keys, push, ids);
                });
}

SettingsTable BoardTable() {
  return Listed("[board]", "the board that each camera's lens is calibrated with",
                [](Settings& keys) {
                  BoardConfig board;
                  ListKeys(keys, board.board);
                  ListKeys(keys, board);
                });
}

SettingsTable CycleTable() {
  return Listed("[cycle]", "", [](Settings& keys) {
    double period_s = DaemonConfig{}.cycle_period_s;
    ListCycleKeys(keys, period_s);
  });
}

SettingsTable FrameTable() {
  return Listed("[[frame]]", "a work object; \"measurement\" and \"base\" are built in",
                [](Settings& keys) {
                  PlacedKeys frame;
                  ListFrameKeys(keys, frame);
                });
}

SettingsTable PointTable() {
  return Listed("[[point]]", "one for each point to be corrected", [](Settings& keys) {
    PlacedKeys placed;
    AssemblyPoint point;
    ListPointKeys(keys, placed, point);
  });
}

std::vector<SettingsTable> Tables() {
  return {
      TableOf<DaemonConfig>("", ""),
      RobotTable(),
      TableOf<PayloadPolicy>("[payload]", "what the robot carries"),
      TableOf<PayloadPolicy::ToolLoad>("[[payload.tool]]",
                                       "of source \"table\": one for each tool number"),
      TableOf<PlcConfig>("[plc]", "where corrected points are read: config/register-map.md"),
      TableOf<modbus::RtuSlaveOptions>("[plc.rtu]", "the same map on a serial line as well"),
      TableOf<CorrectionLimits>("[correction]", "a larger correction is refused, not limited"),
      PushTable(),
      TableOf<LoopConfig>("[loop]",
                          "probes: measured points against the model, and what follows from them"),
      TableOf<CameraConfig>(
          "[camera]",
          "a camera that measures tags; without this table there is no camera. For two, write "
          "[[camera]] twice, each with a name and a [camera.zoom] of its own"),
      ZoomTable(),
      BoardTable(),
      TableOf<TagsConfig>("[tags]", "needed with [camera]; both see the same ones"),
      TableOf<OverlayConfig>(
          "[overlay]", "the display: plumbline-view plumbline.toml; MANUAL.md, \"The monitor\""),
      TableOf<PageConfig>("[page]",
                          "plumbline-view for a browser, to look only; MANUAL.md, \"The page\""),
      TableOf<MqttConfig>(
          "[mqtt]",
          "what a plant's broker is sent: plumbline-fleet; MANUAL.md, \"The plant's "
          "broker\""),
      CycleTable(),
      FrameTable(),
      PointTable(),
  };
}

/// Parts that are not empty, separated by "; ".
std::string Joined(std::initializer_list<std::string> parts) {
  std::string text;
  for (const std::string& part : parts) {
    if (!part.empty()) text += (text.empty() ? "" : "; ") + part;
  }
  return text;
}

/// The line that a first cell must edit, as a number in front of its meaning.
std::string StepOf(const Setting& setting) {
  return setting.meaning.step > 0 ? fmt::format("({}) ", setting.meaning.step) : "";
}

std::string DefaultOf(const Setting& setting) {
  if (setting.meaning.required) return "required";
  return setting.meaning.otherwise.empty() ? setting.value : std::string(setting.meaning.otherwise);
}

/// The unit that a key's name ends with; empty where it has none.
std::string UnitOf(std::string_view key) {
  constexpr std::array<std::string_view, 9> kUnits = {"mm", "ms", "s",   "deg",   "px",
                                                      "kg", "K",  "MPa", "counts"};
  if (const std::size_t at = key.find("_per_"); at != std::string_view::npos) {
    return fmt::format("1/{}", key.substr(at + 5));
  }
  const std::string_view end = key.substr(key.rfind('_') + 1);
  if (end == "hz") return "Hz";
  if (end == "mb") return "MB";
  return std::find(kUnits.begin(), kUnits.end(), end) == kUnits.end() ? "" : std::string(end);
}

/// Adds a line of TOML with a comment beside it, which continues below it if it is long.
void AddLine(std::string& text, std::string line, std::string_view comment, bool active) {
  constexpr std::size_t kLongest = 100, kColumn = 26;
  const std::string sign = active ? "" : "# ";
  line = sign + line;
  if (!comment.empty()) line.resize(std::max(line.size() + 1, kColumn), ' ');
  std::string margin = active ? "" : "#";
  margin.resize(kColumn, ' ');
  if (!comment.empty()) line += '#';
  while (!comment.empty()) {
    const std::size_t end = std::min(comment.find(' '), comment.size());
    if (line.size() + 1 + end > kLongest) {
      text += line + '\n';
      line = margin + '#';
    }
    line += ' ' + std::string(comment.substr(0, end));
    comment.remove_prefix(std::min(end + 1, comment.size()));
  }
  text += line + '\n';
}

constexpr std::string_view kTomlHead =
    R"(# plumblined: the one file to edit. Every key is here; a line that is commented out shows its
# default. `plumbline check plumbline.toml` lists every fault before the daemon reads it, and SIGHUP
# makes a running daemon read the file again (a faulty file changes nothing).
#
# The first real cell: edit the ten lines marked (1)..(10), then run the check.
# A relative path is relative to this file; if it is not there, to the installed data directory.
)";

constexpr std::string_view kManHead = R"(.TH PLUMBLINE.TOML 5 "" "Plumbline" "Plumbline"
.SH NAME
plumbline.toml \- configuration of plumblined
.SH DESCRIPTION
A TOML file. The lines marked (1) to (10) are those that a first cell needs.
.PP
.B plumbline check
.I FILE
lists every fault at once, each with file, line, key, value and range.
.SH KEYS
)";

constexpr std::string_view kManEnd = R"(.SH FILES
.I /etc/plumbline/plumbline.toml
.SH SEE ALSO
.BR plumblined (8),
.BR plumbline\-view (8),
.BR plumbline\-fleet (8),
.BR plumbline (1)
)";

}  // namespace

std::string SettingsToml() {
  std::string text(kTomlHead);
  for (const SettingsTable& table : Tables()) {
    const bool part = table.header.find('.') != std::string_view::npos;  // of the table above it
    if (!part) text += '\n';
    if (!table.header.empty()) {
      AddLine(text, std::string(table.header), table.meaning, table.active());
    }
    for (const Setting& setting : table.keys) {
      const Meaning& meaning = setting.meaning;
      const std::string otherwise =
          meaning.otherwise.empty() ? "" : fmt::format("default: {}", meaning.otherwise);
      AddLine(text,
              fmt::format("{} = {}", setting.key,
                          meaning.example.empty() ? setting.value : std::string(meaning.example)),
              StepOf(setting) + Joined({setting.range, std::string(meaning.sentence), otherwise}),
              meaning.active);
    }
  }
  return text;
}

std::string SettingsMarkdown() {
  std::string text =
      "| key | type | unit | default | range | meaning |\n|---|---|---|---|---|---|\n";
  for (const SettingsTable& table : Tables()) {
    if (!table.header.empty()) {
      text += fmt::format("| **`{}`** | | | | | {} |\n", table.header, table.meaning);
    }
    for (const Setting& setting : table.keys) {
      text += fmt::format("| `{}` | {} | {} | {} | {} | {}{} |\n", setting.key, setting.type,
                          UnitOf(setting.key), DefaultOf(setting), setting.range, StepOf(setting),
                          setting.meaning.sentence);
    }
  }
  return text;
}

std::string SettingsManPage() {
  std::string text(kManHead);
  for (const SettingsTable& table : Tables()) {
    if (!table.header.empty()) text += fmt::format(".SS {}\n{}\n", table.header, table.meaning);
    for (const Setting& setting : table.keys) {
      const std::string value = DefaultOf(setting);
      text +=
          fmt::format(".TP\n.B {}\n{}.\n", setting.key,
                      Joined({setting.type, setting.range,
                              StepOf(setting) + std::string(setting.meaning.sentence),
                              value.empty() || value == "required" ? value : "default: " + value}));
    }
  }
  return text.append(kManEnd);
}

}  // namespace plumbline
