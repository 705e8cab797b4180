#include "app/programs/correction/stated_context.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/loads/numbered_load.h"

namespace plumbline::programs {
namespace {

constexpr double kSame_m = 1e-9, kSame_rad = 1e-9, kSame_kg = 1e-9;

bool SamePose(const Pose& a, const Pose& b) {
  return (a.p - b.p).norm() <= kSame_m &&
         VectorFromRotation(a.R * b.R.transpose()).norm() <= kSame_rad;
}

std::string MmText(const Vec3& p) {
  const Vec3 mm = kMmPerMetre * p;
  return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", mm.x(), mm.y(), mm.z());
}

/// The number with which a key ends: "UTOOL 2", "TOOL_DATA[3]".
std::optional<int> NumberInKey(std::string_view key) {
  while (!key.empty() && (key.back() == ']' || key.back() == ')' || key.back() == ' ')) {
    key.remove_suffix(1);
  }
  const std::size_t last = key.find_last_not_of("0123456789");
  const std::string_view digits = key.substr(last == std::string_view::npos ? 0 : last + 1);
  int number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return error == std::errc() && end == digits.data() + digits.size() ? std::optional(number)
                                                                      : std::nullopt;
}

/// A mass and its first moment about the origin of the flange frame.
struct Mass {
  double kg = 0;
  Vec3 kg_m = Vec3::Zero();

  void Add(double mass_kg, const Vec3& cog_F) {
    kg += mass_kg;
    kg_m += mass_kg * cog_F;
  }
};

}  // namespace

bool MotionContext::Agrees(const MotionContext& other) const {
  return tool == other.tool && SamePose(X_TP, other.X_TP) && SamePose(X_BU, other.X_BU) &&
         std::abs(payload.mass_kg - other.payload.mass_kg) <= kSame_kg &&
         (payload.mass_kg * payload.cog_F - other.payload.mass_kg * other.payload.cog_F).norm() <=
             kSame_kg;
}

Result<const MotionContext*> ContextResolver::Of(const MotionAt& motion, const Point& point) {
  SettingAt tool = motion[Slot::kTool], base = motion[Slot::kBase];
  for (const Slot slot : {Slot::kTool, Slot::kBase, Slot::kLoad, Slot::kExtra}) {
    if (!motion[slot].known()) return Error{motion[slot].unknown};
  }
  if (tool.key.empty()) tool.key = point.stated_tool;
  if (base.key.empty()) base.key = point.stated_base;
  const SettingAt &load = motion[Slot::kLoad], &extra = motion[Slot::kExtra];
  const std::string keys = tool.key + '\0' + base.key + '\0' + load.key + '\0' + extra.key;
  auto known = known_.find(keys);
  if (known == known_.end()) {
    known = known_.emplace(keys, Resolve(tool, base, load, extra)).first;
  }
  if (!known->second) return known->second.failure();
  return &known->second.value();
}

Result<MotionContext> ContextResolver::Resolve(const SettingAt& tool, const SettingAt& base,
                                               const SettingAt& load,
                                               const SettingAt& extra) const {
  MotionContext context;
  if (const Result<void> added = AddTool(tool, context); !added) return added.failure();
  if (const Result<void> added = AddBase(base, context); !added) return added.failure();
  if (const Result<void> added = AddLoad(tool, load, extra, context); !added) {
    return added.failure();
  }
  return context;
}

Result<void> ContextResolver::AddTool(const SettingAt& tool, MotionContext& context) const {
  const auto value = program_.tools.find(tool.key);
  const FrameValue* const frame = value == program_.tools.end() ? nullptr : &value->second;
  if (frame != nullptr && !frame->changes.empty()) {
    return Error{fmt::format("tool {}: {}", tool.key, frame->changes)};
  }
  std::optional<int> number;
  if (const auto stated = stated_.tool_numbers.find(tool.key);
      stated != stated_.tool_numbers.end()) {
    number = stated->second;
  } else if (tool.key.empty()) {
    number = stated_.tool_number;
    if (!number) {
      return Error{"the program sets no tool; give --tool NUMBER, that of the cell's [[tool]]"};
    }
  } else if (frame == nullptr) {
    number = NumberInKey(tool.key);
    if (!number || (!cell_.tool.number && cell_.tools() == 1)) {
      return Error{fmt::format(
          "tool {}: its values are in none of the files; give --tool '{}=NUMBER', that of the "
          "cell's [[tool]], and --frames if its tool point is not that tool's tip",
          tool.key, tool.key)};
    }
    context.tool_assumption = fmt::format(
        "tool {}: its values are in none of the files; it is taken to be the cell's [[tool]] {} by "
        "its number, and its tool point to be that tool's tip. If not, give --tool '{}=NUMBER', or "
        "--frames with its pose",
        tool.key, *number, tool.key);
  }
  if (number) {
    const std::optional<int> index = loads::ToolIndexOf(cell_, number);
    if (!index)
      return Error{fmt::format("tool {}: the cell declares no tool {}", tool.key, *number)};
    context.tool = *index;
  } else {
    int matches = 0;
    for (int index = 0; index < cell_.tools(); ++index) {
      if ((arm_.X_FT(index).p - frame->X.p).norm() > kSameTip_m) continue;
      context.tool = index;
      ++matches;
    }
    if (matches != 1) {
      return Error{fmt::format(
          "tool {}: its tool point {} is {}; give --tool '{}=NUMBER' to name the [[tool]] that it "
          "is on",
          tool.key, MmText(frame->X.p),
          matches == 0 ? "the tip of no tool of the cell" : "the tip of several tools of the cell",
          tool.key)};
    }
  }
  if (frame != nullptr) context.X_TP = arm_.X_FT(context.tool).Inverse() * frame->X;
  const std::optional<int>& declared = cell_.ToolAt(context.tool).number;
  context.tool_text = (tool.key.empty() ? "the cell's tool" : tool.key) +
                      (declared ? fmt::format(" = tool {}", *declared) : std::string());
  return {};
}

Result<void> ContextResolver::AddBase(const SettingAt& base, MotionContext& context) const {
  context.base_text = base.key.empty() ? "the robot's base" : base.key;
  if (base.key.empty()) return {};
  const auto value = program_.bases.find(base.key);
  if (value == program_.bases.end()) {
    return Error{fmt::format(
        "base {}: its values are in none of the files; give --base '{}=x,y,z,...' as the "
        "controller shows it",
        base.key, base.key)};
  }
  if (!value->second.changes.empty()) {
    return Error{fmt::format("base {}: {}", base.key, value->second.changes)};
  }
  context.X_BU = value->second.X;
  return {};
}

Result<loads::Payload> ContextResolver::PayloadOf(const StatedPayload& stated) const {
  if (stated.mass_kg > 0 && !stated.cog_F && !cell_.payload_cog_F) {
    return Error{
        "--load: give the centre of gravity, too (KG,X,Y,Z in mm): the cell has no "
        "[payload] cog_mm"};
  }
  loads::Payload payload;
  payload.mass_kg = stated.mass_kg;
  payload.cog_F = stated.cog_F ? *stated.cog_F : cell_.payload_cog_F.value_or(Vec3::Zero());
  return payload;
}

Vec3 ContextResolver::CogInFlange(const LoadValue& load, const MotionContext& context) const {
  return load.cog_in_tool ? arm_.X_FT(context.tool) * (context.X_TP * load.cog_F) : load.cog_F;
}

Result<void> ContextResolver::AddLoad(const SettingAt& tool, const SettingAt& load,
                                      const SettingAt& extra, MotionContext& context) const {
  const auto value = program_.tools.find(tool.key);
  const std::optional<LoadValue> own =
      value == program_.tools.end() ? std::nullopt : value->second.load;
  Mass carried;
  const auto stated_for = [&](const std::string& key) -> const StatedPayload* {
    const auto at = stated_.payloads.find(key);
    return key.empty() || at == stated_.payloads.end() ? nullptr : &at->second;
  };
  const StatedPayload* stated = stated_for(load.key);
  if (stated == nullptr) stated = stated_for(tool.key);
  if (stated == nullptr && load.key.empty() && !own && stated_.payload) stated = &*stated_.payload;
  if (stated != nullptr) {
    const Result<loads::Payload> payload = PayloadOf(*stated);
    if (!payload) return payload.failure();
    carried.Add(payload->mass_kg, payload->cog_F);
  } else {
    if (load.key.empty() && !own) {
      return Error{
          "the program states no load; give --load KG[,X,Y,Z], what is carried beside the tool"};
    }
    const auto add = [&](const std::string& key, const LoadValue& one) -> Result<void> {
      if (!one.mass_kg) {
        return Error{fmt::format(
            "load {}: not entered; give --load '{}=KG[,X,Y,Z]', what is carried beside the tool",
            key, key)};
      }
      carried.Add(*one.mass_kg, CogInFlange(one, context));
      return {};
    };
    // A load that is set is the whole load: what the tool is declared with is then not in force.
    if (load.key.empty()) {
      if (const Result<void> added = add(tool.key, *own); !added) return added;
    } else {
      const auto entered = program_.loads.find(load.key);
      const Result<void> added =
          add(load.key, entered == program_.loads.end() ? LoadValue{} : entered->second);
      if (!added) return added;
    }
    if (!stated_.loads_without_tool) {
      const loads::GravityLoads& masses = arm_.loads();
      const model::Tool& of_cell = cell_.ToolAt(context.tool);
      const double tool_kg = masses.tool_mass_kg(context.tool);
      constexpr double kRounding_kg = 0.05;
      if (carried.kg < tool_kg - kRounding_kg) {
        return Error{fmt::format(
            "load {} of {:.6g} kg is less than the tool of the cell, {:.6g} kg; correct it, or "
            "give --loads-without-tool if the loads of this program do not contain the tool",
            load.key.empty() ? tool.key : load.key, carried.kg, tool_kg)};
      }
      carried.kg -= tool_kg;
      carried.kg_m -= masses.tool_body_kg_m(context.tool) +
                      Vec3(0, 0, of_cell.mount_mass_kg * of_cell.Length() / 2);
    }
  }
  if (!extra.key.empty()) {
    const StatedPayload* const more = stated_for(extra.key);
    const auto entered = program_.loads.find(extra.key);
    if (more != nullptr) {
      const Result<loads::Payload> payload = PayloadOf(*more);
      if (!payload) return payload.failure();
      carried.Add(payload->mass_kg, payload->cog_F);
    } else if (entered == program_.loads.end() || !entered->second.mass_kg) {
      return Error{
          fmt::format("load {}: not entered; give --load '{}=KG[,X,Y,Z]'", extra.key, extra.key)};
    } else {
      carried.Add(*entered->second.mass_kg, CogInFlange(entered->second, context));
    }
  }
  constexpr double kNone_kg = 1e-6;
  context.payload = {};
  context.payload.tool = context.tool;
  if (carried.kg > kNone_kg) {
    context.payload.mass_kg = carried.kg;
    context.payload.cog_F = carried.kg_m / carried.kg;
  }
  if (context.payload.mass_kg > loads::kMaxPayload_kg) {
    return Error{
        fmt::format("the load of {:.6g} kg exceeds {:g} kg", carried.kg, loads::kMaxPayload_kg)};
  }
  context.load_text =
      fmt::format("{:.7g} kg beside the tool", std::round(1e3 * context.payload.mass_kg) / 1e3);
  return {};
}

}  // namespace plumbline::programs
