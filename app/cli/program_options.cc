#include "app/cli/program_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "app/base/config/limits.h"
#include "app/base/config/toml_reader.h"
#include "app/cli/number_option.h"
#include "app/programs/correction/point_text.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/text_file.h"

namespace plumbline::cli {
namespace {

std::optional<std::vector<double>> NumbersFrom(const std::string& text) {
  std::vector<double> numbers;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    const auto number = FiniteNumberFromText(std::string_view(text).substr(at, comma - at));
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

bool ReadFrames(config::TomlDocument& document, const programs::Brand& brand,
                programs::Program& program, programs::CorrectionSettings& settings) {
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
  for (const auto& [key, table] : TablesOf(document, root, "tool")) {
    if (const auto number = table.Integer("number", 0, config::kLargestNumber)) {
      settings.stated.tool_numbers[key] = *number;
    }
    if (const auto pose = pose_of(table)) SetTool(key, *pose, program);
    const auto mass_kg = table.Number("load_kg", kLoad);
    const auto cog_F = table.Vector3("cog_mm", config::kPlaceRange);
    if (mass_kg) {
      program.tools[key].load = programs::LoadValue{*mass_kg, cog_F.value_or(Vec3::Zero())};
    }
  }
  for (const auto& [key, table] : TablesOf(document, root, "base")) {
    if (const auto pose = pose_of(table)) SetBase(key, *pose, program);
  }
  for (const auto& [key, table] : TablesOf(document, root, "load")) {
    const auto mass_kg = table.RequiredNumber("payload_kg", kLoad);
    const auto cog_F = table.Vector3("cog_mm", config::kPlaceRange);
    if (mass_kg) settings.stated.payloads[key] = {*mass_kg, cog_F};
  }
  return true;
}

Result<void> ApplyStart(const std::string& text, programs::EntryState& entry) {
  constexpr std::array<std::string_view, programs::kSlots> kNames = {"tool", "base", "load",
                                                                     "extra", "shift"};
  const auto at = text.find('=');
  const std::string name = text.substr(0, at);
  const auto slot = std::ranges::find(kNames, name);
  if (at == std::string::npos || slot == kNames.end()) {
    return Error{fmt::format(
        "--start {}: give tool=KEY, base=KEY, load=KEY, extra=KEY or shift=none", text)};
  }
  const std::string key = text.substr(at + 1);
  if (name == "shift" && key != "none") {
    return Error{fmt::format("--start {}: only shift=none can be stated", text)};
  }
  entry.keys[static_cast<std::size_t>(slot - kNames.begin())] = key == "none" ? "" : key;
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

Result<void> ApplyStated(const StatedTexts& texts, const programs::Brand& brand,
                         programs::Program& program, programs::CorrectionSettings& settings) {
  if (!texts.frames.empty()) {
    const Result<std::string> text = files::ReadTextFile(texts.frames);
    if (!text) {
      return Error{texts.frames + ": " + files::ReadErrorText(texts.frames, text.error())};
    }
    config::FaultList faults;
    static_cast<void>(
        config::ReadDocument(*text, texts.frames, faults, [&](config::TomlDocument& document) {
          return ReadFrames(document, brand, program, settings);
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
    if (key.empty()) {
      settings.stated.payload = *payload;
    } else {
      settings.stated.payloads[key] = *payload;
    }
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
  for (const std::string& text : texts.starts) {
    if (const Result<void> applied = ApplyStart(text, settings.entry); !applied) return applied;
  }
  return {};
}

}  // namespace plumbline::cli
