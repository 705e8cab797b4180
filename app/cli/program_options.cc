#include "app/cli/program_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <numeric>
#include <set>
#include <utility>

#include "app/base/config/limits.h"
#include "app/base/config/toml_reader.h"
#include "app/base/text/text.h"
#include "app/cli/number_option.h"
#include "app/programs/correction/point_text.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/text_file.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/loads/numbered_load.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::cli {
namespace {

std::optional<std::vector<double>> NumbersFrom(const std::string& text) {
  std::vector<double> numbers;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    std::string_view cell = std::string_view(text).substr(at, comma - at);
    while (cell.starts_with(' ')) cell.remove_prefix(1);
    while (cell.ends_with(' ')) cell.remove_suffix(1);
    const auto number = FiniteNumberFromText(cell);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
    at = comma + 1;
  }
  return numbers;
}

/// KEY and value of "KEY=VALUE"; keys may contain "=" and commas.
struct KeyAndValue {
  std::string key, value;
};
KeyAndValue SplitAtLastEqualSign(const std::string& text) {
  const auto at = text.rfind('=');
  if (at == std::string::npos) return {"", text};
  return {text.substr(0, at), text.substr(at + 1)};
}

/// A pose in the brand's numbers: a position alone is one without turn.
Result<Pose> PoseFrom(const std::vector<double>& numbers, const programs::Conventions& convention) {
  const std::size_t all = 3 + static_cast<std::size_t>(convention.orientation_numbers);
  if (numbers.size() == 3) {
    return Pose{Mat3::Identity(), convention.m_per_unit * Vec3(numbers[0], numbers[1], numbers[2])};
  }
  if (numbers.size() != all) {
    return Error{fmt::format("has {} numbers; give x, y, z, or these and the {} of the orientation",
                             numbers.size(), convention.orientation_numbers)};
  }
  const Result<Mat3> R = convention.rotation(std::span(numbers).subspan(3));
  if (!R) return R.failure();
  return Pose{*R, convention.m_per_unit * Vec3(numbers[0], numbers[1], numbers[2])};
}

void SetTool(const std::string& key, const Pose& X, programs::Program& program) {
  programs::FrameValue& tool = program.tools[key];
  tool.X = X;
  tool.changes.clear();
}

void SetBase(const std::string& key, const Pose& X, programs::Program& program) {
  programs::FrameValue& base = program.bases[key];
  base.X = X;
  base.changes.clear();
}

using Keys = std::set<std::string, std::less<>>;

/// The keys that the program's lines and points use.
struct UsedKeys {
  Keys tools, bases, loads;
};

UsedKeys KeysOf(const programs::Program& program, const programs::EntryState& entry) {
  UsedKeys used;
  const auto add = [](Keys& keys, const std::optional<programs::Setting>& setting) {
    if (setting && !setting->key.empty()) keys.insert(setting->key);
  };
  for (const programs::Routine& routine : program.routines) {
    for (const programs::Step& step : routine.steps) {
      add(used.tools, step.motion.tool);
      add(used.bases, step.motion.base);
      add(used.loads, step.motion.load);
      using Kind = programs::StepKind;
      if (step.kind == Kind::kSetTool) add(used.tools, step.setting);
      if (step.kind == Kind::kSetBase) add(used.bases, step.setting);
      if (step.kind == Kind::kSetLoad || step.kind == Kind::kSetExtra)
        add(used.loads, step.setting);
    }
  }
  for (const programs::Point& point : program.points) {
    if (!point.stated_tool.empty()) used.tools.insert(point.stated_tool);
    if (!point.stated_base.empty()) used.bases.insert(point.stated_base);
  }
  for (const programs::Slot slot : {programs::Slot::kTool, programs::Slot::kBase,
                                    programs::Slot::kLoad, programs::Slot::kExtra}) {
    const auto& key = entry.keys[static_cast<std::size_t>(slot)];
    if (!key || key->empty()) continue;
    (slot == programs::Slot::kTool   ? used.tools
     : slot == programs::Slot::kBase ? used.bases
                                     : used.loads)
        .insert(*key);
  }
  used.loads.insert(used.tools.begin(), used.tools.end());  // a payload may be stated by tool
  return used;
}

/// Number of insertions, deletions and replacements between two keys (Levenshtein).
std::size_t Distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row.back();
}

/// Why a stated key has no effect; empty if it has one.
std::string UnusedText(const std::string& what, const std::string& key, const char* kind,
                       const Keys& used) {
  constexpr std::size_t kLongest = 200;
  if (used.contains(key)) return "";
  const auto nearest = std::ranges::min_element(used, {}, [&](const std::string& other) {
    return Distance(std::string_view(key).substr(0, kLongest),
                    std::string_view(other).substr(0, kLongest));
  });
  return fmt::format(
      "{}: no line of the program uses the {} '{}'; {}", what, kind, text::Visible(key),
      nearest == used.end()
          ? fmt::format("it uses no {} by a name", kind)
          : fmt::format("the nearest that it uses is '{}'", text::Visible(*nearest)));
}

/// A table [kind."KEY"] of the file.
struct KeyedTable {
  std::string key;
  config::TomlTable table;
};

std::vector<KeyedTable> TablesOf(config::TomlDocument& document, const config::TomlTable& root,
                                 const char* kind) {
  std::vector<KeyedTable> tables;
  const auto parent = root.Table(kind);
  const toml::table* const tree = document.tree()[kind].as_table();
  if (!parent || tree == nullptr) return tables;
  for (const auto& [key, node] : *tree) {
    if (const auto table = parent->Table(key.str())) {
      tables.push_back({std::string(key.str()), *table});
    }
  }
  return tables;
}

/// @param at_tip  gets the keys of tools whose tool point neither this file nor the program states
bool ReadFrames(config::TomlDocument& document, const programs::Brand& brand, const UsedKeys& used,
                programs::Program& program, programs::CorrectionSettings& settings,
                std::vector<std::string>& at_tip) {
  constexpr config::NumberRange kAny{-1e6, 1e6};
  constexpr config::NumberRange kLoad{0, loads::kMaxPayload_kg};
  const config::TomlTable root = document.Root();
  const auto pose_of = [&](const config::TomlTable& table) -> std::optional<Pose> {
    const auto numbers = table.Numbers("pose", kAny);
    if (!numbers) return std::nullopt;
    const Result<Pose> pose = PoseFrom(*numbers, brand.conventions());
    if (!pose) table.AddFault("pose", pose.error());
    return pose ? std::optional(*pose) : std::nullopt;
  };
  const auto note_unused = [](const char* kind, const std::string& key, const Keys& keys) {
    const std::string text =
        UnusedText(fmt::format("--frames: [{}.\"{}\"]", kind, text::Visible(key)), key, kind, keys);
    if (!text.empty()) std::cerr << text << '\n';
  };
  for (const auto& [key, table] : TablesOf(document, root, "tool")) {
    note_unused("tool", key, used.tools);
    const bool in_files = program.tools.contains(key);
    if (const auto number = table.Integer("number", 0, config::kLargestNumber)) {
      settings.stated.tool_numbers[key] = *number;
    }
    const auto pose = pose_of(table);
    if (pose) SetTool(key, *pose, program);
    const auto mass_kg = table.Number("load_kg", kLoad);
    const auto cog_F = table.Vector3("cog_mm", config::kPlaceRange);
    if (mass_kg) {
      program.tools[key].load = programs::LoadValue{*mass_kg, cog_F.value_or(Vec3::Zero())};
      if (!pose && !in_files) at_tip.push_back(key);
    }
  }
  for (const auto& [key, table] : TablesOf(document, root, "base")) {
    note_unused("base", key, used.bases);
    if (const auto pose = pose_of(table)) SetBase(key, *pose, program);
  }
  for (const auto& [key, table] : TablesOf(document, root, "load")) {
    note_unused("load", key, used.loads);
    const auto mass_kg = table.RequiredNumber("payload_kg", kLoad);
    const auto cog_F = table.Vector3("cog_mm", config::kPlaceRange);
    if (mass_kg) settings.stated.payloads[key] = {*mass_kg, cog_F};
  }
  return true;
}

Result<void> ApplyStart(const std::string& text, const model::Robot& robot,
                        programs::CorrectionSettings& settings) {
  constexpr std::array<std::string_view, programs::kStatedSlots> kNames = {"tool", "base", "load",
                                                                           "extra", "shift"};
  const auto at = text.find('=');
  const std::string name = text.substr(0, at);
  if (at != std::string::npos && name == "joints") {
    settings.start_q = JointsFromText(text.substr(at + 1), robot);
    if (settings.start_q) return {};
    return Error{
        fmt::format("--start {}: give {} joint values, in degrees or mm", text, robot.size())};
  }
  const auto slot = std::ranges::find(kNames, name);
  if (at == std::string::npos || slot == kNames.end()) {
    return Error{fmt::format(
        "--start {}: give tool=KEY, base=KEY, load=KEY, extra=KEY, shift=none or joints=Q1,Q2,..",
        text)};
  }
  const std::string key = text.substr(at + 1);
  if (name == "shift" && key != "none") {
    return Error{fmt::format("--start {}: only shift=none can be stated", text)};
  }
  settings.entry.keys[static_cast<std::size_t>(slot - kNames.begin())] = key == "none" ? "" : key;
  return {};
}

}  // namespace

std::optional<programs::StatedPayload> PayloadFromText(const std::string& text) {
  const auto numbers = NumbersFrom(text);
  if (!numbers || (numbers->size() != 1 && numbers->size() != 4)) return std::nullopt;
  if (numbers->front() < 0 || numbers->front() > loads::kMaxPayload_kg) return std::nullopt;
  programs::StatedPayload payload{numbers->front(), std::nullopt};
  if (numbers->size() == 4) {
    payload.cog_F = kMetrePerMm * Vec3((*numbers)[1], (*numbers)[2], (*numbers)[3]);
  }
  return payload;
}

std::optional<model::JointVector> JointsFromText(const std::string& text,
                                                 const model::Robot& robot) {
  const auto numbers = NumbersFrom(text);
  if (!numbers || std::ssize(*numbers) != robot.size()) return std::nullopt;
  model::JointVector q(robot.size());
  for (int i = 0; i < q.size(); ++i) {
    const model::JointType type = robot.joints[static_cast<std::size_t>(i)].type;
    q[i] = (*numbers)[static_cast<std::size_t>(i)] * model::PositionForm(type).to_SI;
  }
  return q;
}

Result<void> ApplyStated(const StatedTexts& texts, const programs::Brand& brand,
                         const model::CellModel& cell, programs::Program& program,
                         programs::CorrectionSettings& settings) {
  for (const std::string& text : texts.starts) {
    if (const Result<void> applied = ApplyStart(text, cell.robot, settings); !applied)
      return applied;
  }
  for (const std::string& text : texts.routines) {
    const auto [key, value] = SplitAtLastEqualSign(text);
    if (key.empty() || value != "harmless") {
      return Error{fmt::format(
          "--routine {}: give NAME=harmless for a routine that is in none of the files and moves "
          "nothing and sets no tool, base or load",
          text)};
    }
    settings.entry.harmless.push_back(key);
  }
  const UsedKeys used = KeysOf(program, settings.entry);
  std::vector<std::string> at_tip;
  if (!texts.frames.empty()) {
    const Result<std::string> text = files::ReadTextFile(texts.frames);
    if (!text) {
      return Error{texts.frames + ": " + files::ReadErrorText(texts.frames, text.error())};
    }
    config::FaultList faults;
    static_cast<void>(
        config::ReadDocument(*text, texts.frames, faults, [&](config::TomlDocument& document) {
          return ReadFrames(document, brand, used, program, settings, at_tip);
        }));
    if (faults.HasFaults()) {
      std::string all = config::FaultsText(faults);
      if (all.ends_with('\n')) all.pop_back();
      return Error{all};
    }
  }
  for (const std::string& text : texts.tools) {
    const auto [key, value] = SplitAtLastEqualSign(text);
    const auto number = NumbersFrom(value);
    const bool whole = number && number->size() == 1 && number->front() >= 0 &&
                       number->front() <= config::kLargestNumber &&
                       number->front() == std::floor(number->front());
    if (!whole) {
      return Error{fmt::format(
          "--tool {}: give KEY=NUMBER, or NUMBER for a program that sets no tool: that of the "
          "cell's [[tool]]",
          text)};
    }
    const std::string unused =
        key.empty() ? "" : UnusedText("--tool " + text, key, "tool", used.tools);
    if (!unused.empty()) return Error{unused};
    const int chosen = static_cast<int>(number->front());
    if (key.empty()) {
      settings.stated.tool_number = chosen;
    } else {
      settings.stated.tool_numbers[key] = chosen;
    }
  }
  for (const std::string& text : texts.bases) {
    const auto [key, value] = SplitAtLastEqualSign(text);
    const auto numbers = NumbersFrom(value);
    const Result<Pose> pose = !key.empty() && numbers
                                  ? PoseFrom(*numbers, brand.conventions())
                                  : Result<Pose>(Error{"give KEY=x,y,z and the orientation"});
    if (!pose) return Error{fmt::format("--base {}: {}", text, pose.error())};
    const std::string unused = UnusedText("--base " + text, key, "base", used.bases);
    if (!unused.empty()) return Error{unused};
    SetBase(key, *pose, program);
  }
  for (const std::string& text : texts.loads) {
    const auto [key, value] = SplitAtLastEqualSign(text);
    const auto payload = PayloadFromText(value);
    if (!payload) {
      return Error{fmt::format(
          "--load {}: give KEY=KG or KEY=KG,X,Y,Z (mm in the flange frame); without KEY= wherever "
          "the program states no load",
          text)};
    }
    const std::string unused =
        key.empty() ? "" : UnusedText("--load " + text, key, "load", used.loads);
    if (!unused.empty()) return Error{unused};
    if (key.empty()) {
      settings.stated.payload = *payload;
    } else {
      settings.stated.payloads[key] = *payload;
    }
  }
  if (at_tip.empty()) return {};
  const deflection::LoadedArm arm(cell);
  for (const std::string& key : at_tip) {
    const auto number = settings.stated.tool_numbers.find(key);
    const std::optional<int> index = number == settings.stated.tool_numbers.end()
                                         ? std::nullopt
                                         : loads::ToolIndexOf(cell, number->second);
    if (!index) {
      return Error{fmt::format(
          "{}: [tool.\"{}\"]: give number, that of the cell's [[tool]], or pose: its tool point is "
          "in none of the files",
          texts.frames, text::Visible(key))};
    }
    program.tools[key].X = arm.X_FT(*index);
  }
  return {};
}

}  // namespace plumbline::cli
