#include "app/programs/brands/krl_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "app/programs/brands/krl_routines.h"
#include "app/programs/brands/orientation_branches.h"

namespace plumbline::programs::krl {
namespace {

constexpr double kMPerMm = 1e-3;

Setting UnknownSetting(std::string why) {
  return {"", std::move(why)};
}

PoseNumbers NumbersOf(const Aggregate& aggregate) {
  PoseNumbers numbers;
  for (const Aggregate::Member& member : aggregate.members) {
    const std::size_t index = std::string_view("xyzabc").find(member.name);
    if (member.name.size() == 1 && index < numbers.size()) numbers[index] = member.number;
  }
  return numbers;
}

}  // namespace

std::optional<Pose> PoseOfNumbers(const PoseNumbers& numbers) {
  for (const auto& number : numbers) {
    if (!number) return std::nullopt;
  }
  const auto value = [&](std::size_t i) { return numbers[i]->value; };
  const auto R = RotationFromAbcDegrees(std::array{value(3), value(4), value(5)});
  if (!R) return std::nullopt;
  return Pose{*R, kMPerMm * Vec3(value(0), value(1), value(2))};
}

Settings::Settings(Reading& reading, Names& names) : reading_(reading), names_(names) {
  const Value* const root = names_.GlobalValue("$ROBROOT", "");
  if (root != nullptr) {
    const auto X_root = PoseOfNumbers(root->pose);
    if (X_root) X_root_ = *X_root;
    if (!X_root) root_changes_ = "$ROBROOT is not complete";
  }
  if (const std::string written = WrittenAt("$ROBROOT", ""); !written.empty()) {
    root_changes_ = "$ROBROOT is " + written;
  }
  correction_ = Correction();
  Program& program = reading_.program;
  program.tools.insert_or_assign("$NULLFRAME", FrameValue{});
  FrameValue world;
  world.X = X_root_.Inverse();
  world.changes = root_changes_;
  program.bases.insert_or_assign("$WORLD", world);
  program.bases.insert_or_assign("$NULLFRAME", world);
  ReadFrames("TOOL_DATA", false);
  ReadFrames("BASE_DATA", true);
  ReadLoads();
  const auto declared = std::ranges::find_if(
      program.bases, [](const auto& base) { return base.second.place.line > 0; });
  if (root == nullptr && declared != program.bases.end()) {
    program.remarks.push_back(
        {declared->second.place,
         "$ROBROOT is not in these files and is taken as the world frame: give $machine.dat if the "
         "robot stands elsewhere"});
  }
}

std::string Settings::WrittenAt(std::string_view name, const std::string& path) const {
  for (std::size_t v = 0; v < names_.variables().size(); ++v) {
    const Variable& variable = names_.variable(v);
    if (!SameWord(variable.name, name)) continue;
    if (const Write* const write = names_.WriteTo(v, path)) {
      return "assigned while the program runs, at " + names_.Shown(write->place);
    }
  }
  return "";
}

/// bas.src shifts tools and bases by these variables if a program switches them on.
std::string Settings::Correction() const {
  for (const char* const name :
       {"TOOL_CORR_ON", "TOOL_CORR_W_ON", "BASE_CORR_ON", "M_BAS_COR_ON"}) {
    if (const std::string written = WrittenAt(name, ""); !written.empty()) {
      return fmt::format("{} is {}, and BAS() may shift tool and base by it", name, written);
    }
  }
  return "";
}

std::string Settings::ExternalAxis(std::int64_t base) const {
  const Value* const index =
      names_.GlobalValue("MACHINE_FRAME_DAT", fmt::format("[{}].mach_def_index", base));
  const auto machine = index == nullptr ? std::nullopt : WholeNumberIn(index->text);
  if (!machine || *machine <= 0) return "";
  const Value* const type =
      names_.GlobalValue("MACHINE_DEF", fmt::format("[{}].mech_type", *machine));
  if (type == nullptr || SameWord(type->text, "#NONE") || SameWord(type->text, "#ROBOT")) return "";
  return fmt::format("moved by an external axis (MACHINE_DEF[{}] {})", *machine, type->text);
}

void Settings::ReadFrames(std::string_view name, bool base) {
  const auto variable = names_.Global(name);
  if (!variable) return;
  auto& table = base ? reading_.program.bases : reading_.program.tools;
  for (const auto& [path, value] : names_.variable(*variable).values) {
    if (!value.is_pose) continue;
    FrameValue frame;
    frame.place = value.place;
    const auto X = PoseOfNumbers(value.pose);
    if (X) frame.X = base ? X_root_.Inverse() * *X : *X;
    frame.changes = WrittenAt(name, path);
    if (!X) frame.changes = "one of its six numbers is missing";
    const auto number =
        path.size() > 2 ? WholeNumberIn(path.substr(1, path.size() - 2)) : std::nullopt;
    if (base && frame.changes.empty() && number) frame.changes = ExternalAxis(*number);
    if (base && frame.changes.empty()) frame.changes = root_changes_;
    table.insert_or_assign(std::string(name) + path, std::move(frame));
  }
}

void Settings::ReadLoads() {
  const auto variable = names_.Global("LOAD_DATA");
  auto& loads = reading_.program.loads;
  loads.insert_or_assign("$DEF_L", LoadValue{});
  if (const Value* const mass = names_.GlobalValue("$DEF_L_M", ""); mass != nullptr) {
    const Value* const cog = names_.GlobalValue("$DEF_L_CM", "");
    if (mass->number && *mass->number >= 0 && cog != nullptr && cog->pose[0] && cog->pose[1] &&
        cog->pose[2]) {
      loads["$DEF_L"] = {*mass->number, kMPerMm * Vec3(cog->pose[0]->value, cog->pose[1]->value,
                                                       cog->pose[2]->value)};
    }
  }
  if (!variable) return;
  for (const auto& [path, value] : names_.variable(*variable).values) {
    if (!path.ends_with(".m")) continue;
    const std::string element = path.substr(0, path.size() - 2);
    const Value* const cog = names_.ValueAt(*variable, element + ".cm");
    LoadValue load;
    // -1: not entered.
    if (value.number && *value.number >= 0) load.mass_kg = value.number;
    if (cog != nullptr) {
      for (int i = 0; i < 3; ++i) {
        const auto& number = cog->pose[static_cast<std::size_t>(i)];
        if (number) load.cog_F[i] = kMPerMm * number->value;
        if (!number) load.mass_kg.reset();
      }
    } else if (load.mass_kg && *load.mass_kg > 0) {
      load.mass_kg.reset();
    }
    const std::string key = "LOAD_DATA" + element;
    if (std::string written = WrittenAt("LOAD_DATA", element); !written.empty()) {
      load_changes_.insert_or_assign(key, key + " is " + std::move(written));
    }
    loads.insert_or_assign(key, load);
  }
}

Setting Settings::Tool(std::optional<std::int64_t> number) const {
  if (!number) return UnknownSetting("the number of the tool is not constant");
  if (!correction_.empty()) return UnknownSetting(correction_);
  return {*number <= 0 ? "$NULLFRAME" : fmt::format("TOOL_DATA[{}]", *number), ""};
}

Setting Settings::Base(std::optional<std::int64_t> number) const {
  if (!number) return UnknownSetting("the number of the base is not constant");
  if (!correction_.empty()) return UnknownSetting(correction_);
  return {*number <= 0 ? "$WORLD" : fmt::format("BASE_DATA[{}]", *number), ""};
}

Setting Settings::Load(std::optional<std::int64_t> number) const {
  if (!number) return UnknownSetting("the number of the load is not constant");
  const std::string key = *number <= 0 ? "$DEF_L" : fmt::format("LOAD_DATA[{}]", *number);
  const auto changes = load_changes_.find(key);
  if (changes != load_changes_.end()) return UnknownSetting(changes->second);
  return {key, ""};
}

std::optional<std::int64_t> Settings::WholeNumberAt(const Reference& record,
                                                    std::string_view member) const {
  const Reference part{record.variable, record.name, record.path + std::string(member), ""};
  const Write* write = nullptr;
  const Value* const value = names_.ConstantValueOf(part, write);
  return value == nullptr ? std::nullopt : WholeNumberIn(value->text);
}

Frames Settings::FramesOf(const Reference& record) const {
  const auto tool = WholeNumberAt(record, ".tool_no");
  Frames frames{Tool(tool), Base(WholeNumberAt(record, ".base_no")), Load(tool), ""};
  const std::string why =
      fmt::format("the frame record {} is not written in these files", record.name);
  for (auto* const setting : {&frames.tool, &frames.base, &frames.load}) {
    if (!(*setting)->unknown.empty() && correction_.empty() && load_changes_.empty()) {
      (*setting)->unknown = why;
    }
  }
  const Value* const frame =
      record.variable ? names_.ValueAt(*record.variable, record.path + ".ipo_frame") : nullptr;
  if (frame != nullptr && SameWord(frame->text, "#TCP")) {
    frames.stationary =
        fmt::format("external TCP: the tool is stationary (IPO_FRAME #TCP of {})", record.name);
  }
  return frames;
}

std::optional<Frames> Settings::FunctionFrames(const Statement& statement, std::size_t module,
                                               std::optional<std::size_t> routine,
                                               std::size_t begin) const {
  const bool function = statement.HasWord(begin, "STOOL2") || statement.HasWord(begin, "STOOL") ||
                        statement.HasWord(begin, "SBASE") || statement.HasWord(begin, "SLOAD") ||
                        statement.HasWord(begin, "SIPO_MODE");
  if (!function || !statement.Has(begin + 1, '(')) return std::nullopt;
  const std::size_t close = statement.Behind(begin + 1, statement.size()) - 1;
  const auto number = names_.WholeNumber(statement, module, routine, begin + 2, close);
  if (number || !statement.HasAnyWord(begin + 2)) {
    return Frames{Tool(number), Base(number), Load(number), {}};
  }
  std::size_t behind = begin + 2;
  Reference record = names_.TakeReference(statement, module, routine, behind);
  for (const std::string_view member : {".tool_no", ".base_no", ".ipo_frame"}) {
    if (record.path.ends_with(member)) record.path.resize(record.path.size() - member.size());
  }
  return FramesOf(record);
}

std::optional<Pose> Settings::Constant(const Statement& statement, std::size_t module,
                                       std::optional<std::size_t> routine, std::size_t begin,
                                       std::size_t end, std::string& why) const {
  const std::string text(statement.Text(begin, end, names_.Bytes(statement.file)));
  std::size_t at = begin;
  if (statement.Has(begin, '{')) {
    const auto aggregate = TakeAggregate(statement, names_.Bytes(statement.file), at);
    const auto X = aggregate ? PoseOfNumbers(NumbersOf(*aggregate)) : std::nullopt;
    if (!X || at != end) why = text + " does not state all six numbers";
    return at == end ? X : std::nullopt;
  }
  if (begin < end && statement.HasAnyWord(begin)) {
    if (statement.HasWord(begin, "$NULLFRAME") && end == begin + 1) return Pose{};
    const Reference reference = names_.TakeReference(statement, module, routine, at);
    const Write* write = nullptr;
    const Value* const value = at == end ? names_.ConstantValueOf(reference, write) : nullptr;
    if (write != nullptr) {
      why = fmt::format("{} is assigned while the program runs, at {}", text,
                        names_.Shown(write->place));
      return std::nullopt;
    }
    const auto X = value == nullptr ? std::nullopt : PoseOfNumbers(value->pose);
    if (X) return X;
  }
  why = text + " is not constant";
  return std::nullopt;
}

Setting Settings::Frame(const Statement& statement, std::size_t module,
                        std::optional<std::size_t> routine, std::size_t begin, std::size_t end,
                        bool base) {
  auto& table = base ? reading_.program.bases : reading_.program.tools;
  std::string text(statement.Text(begin, end, names_.Bytes(statement.file)));
  if (begin >= end) return UnknownSetting("it is not understood");
  if (const auto frames = FunctionFrames(statement, module, routine, begin)) {
    return base ? *frames->base : *frames->tool;
  }
  std::size_t at = begin;
  if (statement.HasAnyWord(begin) && !statement.Has(begin + 1, '(')) {
    const Reference reference = names_.TakeReference(statement, module, routine, at);
    if (at == end && reference.component.empty()) {
      if (SameWord(reference.name, "$NULLFRAME")) return {"$NULLFRAME", ""};
      if (base && SameWord(reference.name, "$WORLD")) return {"$WORLD", ""};
      for (const char* const name : {"TOOL_DATA", "BASE_DATA"}) {
        if (!SameWord(reference.name, name)) continue;
        if (reference.path.empty() || reference.path == "[*]") {
          return UnknownSetting(text + " is not constant");
        }
        const std::string key = name + reference.path;
        // A tool that is the base of a stationary tool, and the other way round.
        if (base != (key[0] == 'B')) {
          return UnknownSetting(fmt::format("{} is used as a {}", key, base ? "base" : "tool"));
        }
        return {key, ""};
      }
    }
  }
  // A literal, a variable or a chain of these.
  Pose X;
  for (at = begin; at < end;) {
    const std::size_t next = statement.Find(':', at, end);
    std::string why;
    const bool world = base && statement.HasWord(at, "$WORLD") && next == at + 1;
    const auto part =
        world ? std::optional(Pose{}) : Constant(statement, module, routine, at, next, why);
    if (!part) return UnknownSetting(why);
    X = X * *part;
    at = next + 1;
  }
  FrameValue frame;
  frame.place = statement.place();
  frame.X = base ? X_root_.Inverse() * X : X;
  if (base) frame.changes = root_changes_;
  const auto known = table.find(text);
  if (known != table.end() &&
      (known->second.X.p - frame.X.p).norm() + (known->second.X.R - frame.X.R).norm() > 1e-12) {
    text = fmt::format("{} ({})", text, names_.Shown(statement.place()));
  }
  table.try_emplace(text, std::move(frame));
  return {text, ""};
}

Setting Settings::LoadIn(const Statement& statement, std::size_t module,
                         std::optional<std::size_t> routine, std::size_t begin, std::size_t end) {
  const std::string_view bytes = names_.Bytes(statement.file);
  const std::string text(statement.Text(begin, end, bytes));
  if (const auto frames = FunctionFrames(statement, module, routine, begin)) return *frames->load;
  std::size_t at = begin;
  if (begin < end && statement.HasWord(begin, "LOAD_DATA")) {
    const Reference reference = names_.TakeReference(statement, module, routine, at);
    const std::string_view path = reference.path;
    if (at == end && path.size() > 2 && path.find('.') == std::string_view::npos) {
      return Load(WholeNumberIn(path.substr(1, path.size() - 2)));
    }
  } else if (begin < end && statement.Has(begin, '{')) {
    const auto aggregate = TakeAggregate(statement, bytes, at);
    LoadValue load;
    bool complete = aggregate && at == end;
    bool has_cog = false;
    for (std::size_t i = 0; complete && i < aggregate->members.size(); ++i) {
      const Aggregate::Member& member = aggregate->members[i];
      if (member.name == "m" && member.number && member.number->value >= 0) {
        load.mass_kg = member.number->value;
      }
      if (member.name != "cm" || member.nested.empty()) continue;
      const PoseNumbers cog = NumbersOf(member.nested.front());
      has_cog = cog[0] && cog[1] && cog[2];
      if (has_cog) load.cog_F = kMPerMm * Vec3(cog[0]->value, cog[1]->value, cog[2]->value);
    }
    complete = complete && (has_cog || load.mass_kg == 0.0);
    if (complete) {
      reading_.program.loads.insert_or_assign(text, load);
      return {text, ""};
    }
  }
  return UnknownSetting(text + " is not constant");
}

}  // namespace plumbline::programs::krl
