#include "app/config/settings_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "app/config/daemon_settings.h"

namespace plumbline {
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
  ListDefaults<Board>(keys);
  ListDefaults<BoardConfig>(keys);
}

void ListDefaultCycleKeys(Settings& keys) {
  DaemonConfig config;
  ListCycleKeys(keys, config.cycle_period_s);
}

/// A table of plumbline.toml.
struct SettingsTable {
  std::string_view header;   ///< "[robot]", "[[point]]"; empty: the keys before the first table
  std::string_view meaning;  ///< of the table as a whole
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
    {"[robot]", "where the joints and the payload come from", ListRobotKeys},
    {"[payload]", "what the robot carries", ListDefaults<PayloadPolicy>},
    {"[[payload.tool]]", "of source \"table\": one for each tool number",
     ListDefaults<PayloadPolicy::ToolLoad>},
    {"[plc]", "where corrected points are read: config/register-map.md", ListDefaults<PlcConfig>},
    {"[plc.rtu]", "the same map on a serial line as well", ListDefaults<modbus::RtuSlaveOptions>},
    {"[correction]", "a larger correction is refused, not limited", ListDefaults<CorrectionLimits>},
    {"[push]",
     "corrected points written into the controller's registers; withdrawn when the daemon stops",
     ListPushKeys},
    {"[loop]", "probes: measured points against the model, and what follows from them",
     ListDefaults<LoopConfig>},
    {"[camera]",
     "a camera that measures tags; without this table there is no camera. For two, write "
     "[[camera]] twice, each with a name and a [camera.zoom] of its own",
     ListDefaults<CameraConfig>},
    {"[zoom]", "or [camera.zoom], below its [[camera]]; without it: a lens without zoom",
     ListDefaults<ZoomConfig>},
    {"[board]", "the board that each camera's lens is calibrated with", ListBoardKeys},
    {"[tags]", "needed with [camera]; both see the same ones", ListDefaults<TagsConfig>},
    {"[overlay]", "the display: plumbline-view plumbline.toml; MANUAL.md, \"The monitor\"",
     ListDefaults<OverlayConfig>},
    {"[page]", "plumbline-view for a browser, to look only; MANUAL.md, \"The page\"",
     ListDefaults<PageConfig>},
    {"[mqtt]", "what a plant's broker is sent: plumbline-fleet; MANUAL.md, \"The plant's broker\"",
     ListDefaults<MqttConfig>},
    {"[cycle]", "the control cycle", ListDefaultCycleKeys},
    {"[[frame]]", "a work object; \"measurement\" and \"base\" are built in",
     ListDefaults<FrameKeys>},
    {"[[point]]", "one for each point to be corrected", ListDefaults<PointKeys>},
};

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
  for (const SettingsTable& table : kTables) {
    const std::vector<Setting> keys = table.Keys();
    const bool active = std::any_of(keys.begin(), keys.end(),
                                    [](const Setting& key) { return key.meaning.active; });
    const bool part = table.header.find('.') != std::string_view::npos;  // of the table above it
    if (!part) text += '\n';
    if (!table.header.empty()) AddLine(text, std::string(table.header), table.meaning, active);
    for (const Setting& setting : keys) {
      const Meaning& meaning = setting.meaning;
      const std::string_view value = meaning.example.empty() ? setting.value : meaning.example;
      const std::string otherwise =
          meaning.otherwise.empty() ? "" : fmt::format("default: {}", meaning.otherwise);
      AddLine(text, fmt::format("{} = {}", setting.key, value),
              StepOf(setting) + Joined({setting.range, std::string(meaning.sentence), otherwise}),
              meaning.active);
    }
  }
  return text;
}

std::string SettingsMarkdown() {
  std::string text =
      "| key | type | unit | default | range | meaning |\n|---|---|---|---|---|---|\n";
  for (const SettingsTable& table : kTables) {
    if (!table.header.empty()) {
      text += fmt::format("| **`{}`** | | | | | {} |\n", table.header, table.meaning);
    }
    for (const Setting& setting : table.Keys()) {
      text += fmt::format("| `{}` | {} | {} | {} | {} | {}{} |\n", setting.key, setting.type,
                          UnitOf(setting.key), DefaultOf(setting), setting.range, StepOf(setting),
                          setting.meaning.sentence);
    }
  }
  return text;
}

std::string SettingsManPage() {
  std::string text(kManHead);
  for (const SettingsTable& table : kTables) {
    if (!table.header.empty()) text += fmt::format(".SS {}\n{}\n", table.header, table.meaning);
    for (const Setting& setting : table.Keys()) {
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
