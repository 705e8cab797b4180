#include "app/base/config/settings_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "app/base/config/daemon_settings.h"

namespace plumbline::config {
namespace {

template <typename Config>
void ListDefaults(Settings& keys) {
  Config config;
  ListKeys(keys, config);
}

void ListRobotKeys(Settings& keys) {
  ListDefaults<RobotLinkConfig>(keys);
  ListDefaults<PlausibilityLimits>(keys);
}

void ListPushKeys(Settings& keys) {
  DaemonConfig config;
  ListKeys(keys, config.robot.connection.push, config.push_ids);
}

void ListBoardKeys(Settings& keys) {
  ListDefaults<target::Board>(keys);
  ListDefaults<BoardConfig>(keys);
}

void ListDefaultCycleKeys(Settings& keys) {
  DaemonConfig config;
  ListCycleKeys(keys, config.cycle_period_s);
}

/// A table of plumbline.toml.
struct SettingsTable {
  std::string_view header;  ///< "[robot]", "[[point]]"; empty: the keys before the first table
  std::string_view doc;     ///< description of the table as a whole
  void (*list)(Settings& keys);

  std::vector<Setting> Keys() const {
    std::vector<Setting> rows;
    Settings keys(rows);
    list(keys);
    return rows;
  }
};

constexpr SettingsTable kTables[] = {
    {"", "", ListDefaults<DaemonConfig>},
    {"[robot]", "the robot controller: source of joint positions and payload", ListRobotKeys},
    {"[payload]", "what the robot carries", ListDefaults<PayloadPolicy>},
    {"[[payload.tool]]", "for source \"table\": one entry per tool number",
     ListDefaults<PayloadPolicy::ToolLoad>},
    {"[plc]", "the Modbus server for the PLC; registers: reference/registers.md",
     ListDefaults<PlcConfig>},
    {"[plc.rtu]", "the same registers on a serial line as well",
     ListDefaults<modbus::RtuSlaveOptions>},
    {"[correction]", "limits of a correction; one beyond them is refused, not clipped",
     ListDefaults<correction::CorrectionLimits>},
    {"[push]",
     "writes corrected points into the controller's registers and withdraws them when the daemon "
     "stops",
     ListPushKeys},
    {"[motion]", "corrects a running motion, packet by packet; motion.md",
     ListDefaults<MotionKeys>},
    {"[monitoring]", "probes (measured points), drift detection, diagnosis, model updates",
     ListDefaults<MonitoringConfig>},
    {"[[gauge]]", "a dial gauge whose button makes a probe; measure.md, \"A gauge with a button\"",
     ListDefaults<GaugeKeys>},
    {"[camera]",
     "a camera that measures tags; without a key here there is no camera. For two cameras, write "
     "[[camera]] twice, each with its own name and [camera.zoom]",
     ListDefaults<CameraConfig>},
    {"[zoom]",
     "zoom sensor of the camera, also written [camera.zoom] below its [[camera]]; without a key "
     "here the lens has no zoom",
     ListDefaults<ZoomConfig>},
    {"[board]", "calibration board for the lens of each camera", ListBoardKeys},
    {"[tags]", "tags in the cell, shared by both cameras; required with [camera]",
     ListDefaults<TagsConfig>},
    {"[overlay]", "what plumbline-view shows on the display; run.md, \"The display\"",
     ListDefaults<OverlayConfig>},
    {"[page]", "read-only web page of plumbline-view; run.md, \"The page\"",
     ListDefaults<PageConfig>},
    {"[mqtt]",
     "what plumbline-fleet publishes to the plant's MQTT broker; run.md, \"The plant's broker\"",
     ListDefaults<MqttConfig>},
    {"[cycle]", "the control cycle", ListDefaultCycleKeys},
    {"[[frame]]", "a work object frame; \"measurement\" and \"base\" are built in",
     ListDefaults<FrameKeys>},
    {"[[point]]", "one entry per point to be corrected", ListDefaults<PointKeys>},
};

/// The non-empty parts, separated by "; ".
std::string Joined(std::initializer_list<std::string> parts) {
  std::string text;
  for (const std::string& part : parts) {
    if (!part.empty()) text += (text.empty() ? "" : "; ") + part;
  }
  return text;
}

/// "(3) " in front of the description of a line to edit for a first cell.
std::string StepOf(const Setting& setting) {
  const int step = setting.doc.first_cell_step;
  return step > 0 ? fmt::format("({}) ", step) : "";
}

std::string DefaultOf(const Setting& setting) {
  if (setting.doc.required) return "required";
  return setting.doc.default_text.empty() ? setting.value : std::string(setting.doc.default_text);
}

/// The unit that a key's name ends with, or empty.
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

/// Adds a line of TOML with a trailing comment, which continues on the lines below if it is long.
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
    R"(# Configuration of plumblined: the one file to edit. It lists every key; a commented-out line shows
# the default, and a table without a key counts as absent. `plumbline check plumbline.toml` reports
# every fault before the daemon reads the file; SIGHUP makes a running daemon reload it (a faulty file
# changes nothing).
#
# For a first cell, edit the ten lines marked (1) to (10), then run the check.
# A relative path refers to the directory of this file; cell and profile files that are not there are
# taken from the installed data directory.
)";

constexpr std::string_view kManHead = R"(.TH PLUMBLINE.TOML 5 "" "Plumbline" "Plumbline"
.SH NAME
plumbline.toml \- configuration of plumblined
.SH DESCRIPTION
A TOML file. A first cell needs only the lines marked (1) to (10).
.PP
.B plumbline check
.I FILE
reports all faults at once, each with file, line, key, value and allowed range.
.SH KEYS
)";

constexpr std::string_view kManEnd = R"(.SH FILES
.I /etc/plumbline/plumbline.toml
.SH SEE ALSO
.BR plumblined (8),
.BR plumbline\-view (8),
.BR plumbline\-fleet (8),
.BR plumbline (1),
.I /usr/share/doc/plumbline/commission.md
)";

}  // namespace

std::vector<std::string> HeadersWithKey(std::string_view key) {
  std::vector<std::string> headers;
  for (const SettingsTable& table : kTables) {
    if (table.header.empty()) continue;
    for (const Setting& setting : table.Keys()) {
      if (setting.key == key) headers.emplace_back(table.header);
    }
  }
  return headers;
}

std::string SettingsToml() {
  std::string text(kTomlHead);
  for (const SettingsTable& table : kTables) {
    const std::vector<Setting> keys = table.Keys();
    const bool is_subtable = table.header.find('.') != std::string_view::npos;
    if (!is_subtable) text += '\n';
    // Never commented out: a key that is added below it would take effect in the table above.
    if (!table.header.empty()) AddLine(text, std::string(table.header), table.doc, true);
    for (const Setting& setting : keys) {
      const SettingDoc& doc = setting.doc;
      const std::string_view value = doc.example.empty() ? setting.value : doc.example;
      const std::string default_text =
          doc.default_text.empty() ? "" : fmt::format("default: {}", doc.default_text);
      AddLine(text, fmt::format("{} = {}", setting.key, value),
              StepOf(setting) + Joined({setting.range, std::string(doc.description), default_text}),
              doc.active);
    }
  }
  return text;
}

std::string SettingsMarkdown() {
  std::string text = "| key | type | unit | default | range | doc |\n|---|---|---|---|---|---|\n";
  for (const SettingsTable& table : kTables) {
    if (!table.header.empty()) {
      text += fmt::format("| **`{}`** | | | | | {} |\n", table.header, table.doc);
    }
    for (const Setting& setting : table.Keys()) {
      text += fmt::format("| `{}` | {} | {} | {} | {} | {}{} |\n", setting.key, setting.type,
                          UnitOf(setting.key), DefaultOf(setting), setting.range, StepOf(setting),
                          setting.doc.description);
    }
  }
  return text;
}

std::string SettingsManPage() {
  std::string text(kManHead);
  for (const SettingsTable& table : kTables) {
    if (!table.header.empty()) text += fmt::format(".SS {}\n{}\n", table.header, table.doc);
    for (const Setting& setting : table.Keys()) {
      const std::string value = DefaultOf(setting);
      text +=
          fmt::format(".TP\n.B {}\n{}.\n", setting.key,
                      Joined({setting.type, setting.range,
                              StepOf(setting) + std::string(setting.doc.description),
                              value.empty() || value == "required" ? value : "default: " + value}));
    }
  }
  return text.append(kManEnd);
}

}  // namespace plumbline::config
