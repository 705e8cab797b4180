#include "app/base/config/robot_profile_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "app/base/config/toml_reader.h"
#include "app/base/config/wrong_file.h"
#include "drivers/robot/codec.h"
#include "drivers/robot/push_codec.h"

namespace plumbline::config {
namespace {

constexpr NumberRange kScaleRange{-1e9, 1e9};
constexpr int kLastRegister = 65535;

/// A unit in the file: SI value = factor * value + shift.
struct Unit {
  double factor = 1;
  double shift = 0;
};
using Units = std::initializer_list<Choice<Unit>>;

const Units kJointUnits = {{"deg", {kRadPerDeg}}, {"rad", {1}},   {"mrad", {1e-3}},
                           {"urad", {1e-6}},      {"mm", {1e-3}}, {"m", {1}}};
const Units kAngleUnits = {{"deg", {kRadPerDeg}}, {"rad", {1}}, {"mrad", {1e-3}}, {"urad", {1e-6}}};
const Units kLengthUnits = {{"mm", {1e-3}}, {"m", {1}}};
const Units kMassUnits = {{"kg", {1}}, {"g", {1e-3}}};
const Units kTemperatureUnits = {{"C", {1}}, {"K", {1, -273.15}}};

std::optional<robot::RegisterTable> ReadTable(const TomlTable& table) {
  return table.RequiredOneOf<robot::RegisterTable>("table",
                                                   {{"coil", robot::RegisterTable::kCoil},
                                                    {"discrete", robot::RegisterTable::kDiscrete},
                                                    {"holding", robot::RegisterTable::kHolding},
                                                    {"input", robot::RegisterTable::kInput}});
}

std::optional<modbus::WordOrder> ReadOrder(const TomlTable& table) {
  return table.OneOf<modbus::WordOrder>("word_order", {{"ABCD", modbus::WordOrder::kAbcd},
                                                       {"CDAB", modbus::WordOrder::kCdab},
                                                       {"BADC", modbus::WordOrder::kBadc},
                                                       {"DCBA", modbus::WordOrder::kDcba}});
}

/// Reads groups of register values: one value per entry of `address`.
class ProfileReader {
 public:
  explicit ProfileReader(const std::vector<robot::RegisterBlock>& blocks) : blocks_(blocks) {}

  /// @param count  required number of values; negative: at least one
  /// @param units  allowed units; empty: a plain integer without scale and offset
  std::vector<robot::RegisterValue> Values(const TomlTable& table, int count, Units units) const {
    robot::RegisterValue value;
    value.table = ReadTable(table).value_or(value.table);
    value.type = ReadType(table, units.size() > 0).value_or(value.type);
    value.order = ReadOrder(table).value_or(value.order);
    if (units.size() > 0) {
      const double scale = table.Number("scale", kScaleRange).value_or(1);
      if (scale == 0) table.AddFault("scale", "must not be 0: every reading would be the same");
      const double offset = table.Number("offset", kScaleRange).value_or(0);
      const Unit unit = table.RequiredOneOf<Unit>("unit", units).value_or(Unit{});
      value.scale = unit.factor * scale;
      value.offset = unit.factor * offset + unit.shift;
    }
    return AtAddresses(table, "address", count, value);
  }

  std::optional<robot::RegisterValue> Value(const std::optional<TomlTable>& table,
                                            Units units) const {
    if (!table) return std::nullopt;
    const std::vector<robot::RegisterValue> values = Values(*table, 1, units);
    return values.empty() ? std::nullopt : std::optional(values.front());
  }

  std::optional<std::array<robot::RegisterValue, 3>> Three(const TomlTable& table,
                                                           Units units) const {
    const std::vector<robot::RegisterValue> values = Values(table, 3, units);
    if (values.size() != 3) return std::nullopt;
    return std::array{values[0], values[1], values[2]};
  }

  /// A copy of `prototype` for each address listed under `key`.
  std::vector<robot::RegisterValue> AtAddresses(const TomlTable& table, std::string_view key,
                                                int count, robot::RegisterValue prototype) const {
    if (!table.Has(key)) table.AddMissing(key, "a list of registers, 0..65535");
    const auto addresses = table.Integers(key, 0, kLastRegister);
    std::vector<robot::RegisterValue> values;
    if (!addresses) return values;
    if (addresses->empty() || (count >= 0 && static_cast<int>(addresses->size()) != count)) {
      table.AddFault(key, count >= 0 ? fmt::format("is not a list of {} registers", count)
                                     : "is an empty list");
      return values;
    }
    for (const int address : *addresses) {
      prototype.address = address;
      CheckIsRead(table, key, prototype);
      values.push_back(prototype);
    }
    return values;
  }

  void CheckIsRead(const TomlTable& table, std::string_view key,
                   const robot::RegisterValue& value) const {
    if (robot::IsRead(blocks_, value)) return;
    table.AddFault(
        key, fmt::format("contains {}, which no [[read]] of that table covers",
                         WordsOf(value.type) == 2
                             ? fmt::format("registers {}..{}", value.address, value.address + 1)
                             : fmt::format("register {}", value.address)));
  }

 private:
  static std::optional<robot::RegisterType> ReadType(const TomlTable& table, bool may_be_float) {
    if (!may_be_float) {
      return table.RequiredOneOf<robot::RegisterType>("type",
                                                      {{"int16", robot::RegisterType::kInt16},
                                                       {"uint16", robot::RegisterType::kUint16},
                                                       {"int32", robot::RegisterType::kInt32},
                                                       {"uint32", robot::RegisterType::kUint32}});
    }
    return table.RequiredOneOf<robot::RegisterType>("type",
                                                    {{"int16", robot::RegisterType::kInt16},
                                                     {"uint16", robot::RegisterType::kUint16},
                                                     {"int32", robot::RegisterType::kInt32},
                                                     {"uint32", robot::RegisterType::kUint32},
                                                     {"float32", robot::RegisterType::kFloat32}});
  }

  const std::vector<robot::RegisterBlock>& blocks_;
};

std::vector<robot::RegisterBlock> ReadBlocks(const TomlTable& root) {
  std::vector<robot::RegisterBlock> blocks;
  const std::vector<TomlTable> tables = root.Tables("read");
  if (tables.empty()) root.AddMissing("read", "[[read]] with table, first and count");
  for (const TomlTable& table : tables) {
    robot::RegisterBlock block;
    block.table = ReadTable(table).value_or(block.table);
    block.first = table.RequiredInteger("first", 0, kLastRegister).value_or(0);
    block.count = table.RequiredInteger("count", 1, robot::kMaxRegistersOfRead).value_or(1);
    if (block.first + block.count > kLastRegister + 1) {
      table.AddFault("count", "is too large: the block ends beyond register 65535");
    }
    blocks.push_back(block);
  }
  return blocks;
}

void ReadJoints(const TomlTable& root, const ProfileReader& reader,
                std::vector<robot::JointSignal>& joints) {
  const std::vector<TomlTable> tables = root.Tables("joints");
  if (tables.empty()) root.AddMissing("joints", "[[joints]] with the registers of the joints");
  for (const TomlTable& table : tables) {
    const std::vector<robot::RegisterValue> values = reader.Values(table, -1, kJointUnits);
    const robot::JointWrap wrap =
        table
            .OneOf<robot::JointWrap>("wrap", {{"none", robot::JointWrap::kNone},
                                              {"pi", robot::JointWrap::kPi},
                                              {"revolutions", robot::JointWrap::kRevolutions}})
            .value_or(robot::JointWrap::kNone);
    std::vector<robot::RegisterValue> turns(values.size());
    if (wrap == robot::JointWrap::kRevolutions && !values.empty()) {
      robot::RegisterValue turn;
      turn.table = values.front().table;
      turn.type = robot::RegisterType::kInt16;
      turn.scale = table.Number("revolutions_scale", kScaleRange).value_or(1);
      if (turn.scale == 0) table.AddFault("revolutions_scale", "must not be 0");
      turns = reader.AtAddresses(table, "revolutions", static_cast<int>(values.size()), turn);
    }
    for (std::size_t i = 0; i < values.size() && i < turns.size(); ++i) {
      joints.push_back({values[i], wrap, turns[i]});
    }
  }
  if (joints.size() > model::kMaxJoints) {
    root.AddFault("joints", fmt::format("lists {} joints; at most {} are possible", joints.size(),
                                        model::kMaxJoints));
  }
}

std::optional<robot::PoseSignal> ReadPose(const TomlTable& table, const ProfileReader& reader) {
  robot::PoseSignal pose;
  const auto position = table.RequiredTable("position");
  const auto orientation = table.RequiredTable("orientation");
  if (!position || !orientation) return std::nullopt;
  if (const auto values = reader.Three(*position, kLengthUnits)) pose.position = *values;
  if (const auto values = reader.Three(*orientation, kAngleUnits)) pose.orientation = *values;
  pose.convention =
      orientation
          ->RequiredOneOf<robot::ReportedOrientation>(
              "convention", {{"rotation_vector", robot::ReportedOrientation::kRotationVector},
                             {"roll_pitch_yaw", robot::ReportedOrientation::kRollPitchYaw},
                             {"abc", robot::ReportedOrientation::kAbc},
                             {"zyz", robot::ReportedOrientation::kZyz}})
          .value_or(robot::ReportedOrientation::kRotationVector);
  return pose;
}

/// Operating modes of a controller and their names in the profile.
const std::initializer_list<Choice<model::RobotMode>> kModes = {
    {"running", model::RobotMode::kRunning},
    {"manual", model::RobotMode::kManual},
    {"stopped", model::RobotMode::kStopped},
    {"emergency_stop", model::RobotMode::kEmergencyStop},
    {"not_ready", model::RobotMode::kNotReady}};

void ReadMode(const TomlTable& table, const ProfileReader& reader, robot::ModeSignal& mode) {
  if (table.Has("address")) {
    mode.value = reader.Value(table, {});
    for (const Choice<model::RobotMode>& choice : kModes) {
      const auto values = table.Integers(choice.word, -32768, kLastRegister);
      for (const int value : values.value_or(std::vector<int>{})) {
        mode.meanings.push_back({value, choice.value});
      }
    }
  }
  for (const TomlTable& entry : table.Tables("bit")) {
    robot::ModeSignal::Bit bit;
    bit.table = ReadTable(entry).value_or(bit.table);
    bit.address = entry.RequiredInteger("address", 0, kLastRegister).value_or(0);
    bit.bit = entry.Integer("bit", 0, 15).value_or(0);
    bit.when = entry.Bool("when").value_or(true);
    bit.mode =
        entry.RequiredOneOf<model::RobotMode>("mode", kModes).value_or(model::RobotMode::kUnknown);
    robot::RegisterValue word;
    word.table = bit.table;
    word.address = bit.address;
    if (entry.Has("address")) reader.CheckIsRead(entry, "address", word);
    mode.bits.push_back(bit);
  }
}

std::optional<robot::PushProfile> ReadPush(const TomlTable& table) {
  robot::PushProfile push;
  push.first = table.RequiredInteger("first", 0, kLastRegister).value_or(0);
  push.slots = table.RequiredInteger("slots", 1, 64).value_or(1);
  push.stride = table.RequiredInteger("stride", 1, robot::kMaxRegistersOfWrite).value_or(1);
  push.id_place = table.Integer("id_place", 0, robot::kMaxRegistersOfWrite - 1);
  push.pose_place =
      table.RequiredInteger("pose_place", 0, robot::kMaxRegistersOfWrite - 1).value_or(0);
  push.sequence_place =
      table.RequiredInteger("sequence_place", 0, robot::kMaxRegistersOfWrite - 1).value_or(0);
  push.type =
      table
          .RequiredOneOf<robot::RegisterType>("type", {{"int16", robot::RegisterType::kInt16},
                                                       {"int32", robot::RegisterType::kInt32},
                                                       {"float32", robot::RegisterType::kFloat32}})
          .value_or(push.type);
  push.order = ReadOrder(table).value_or(push.order);
  push.position_step_m =
      table.RequiredNumber("position_step_mm", {1e-6, 1000, kMetrePerMm}).value_or(1e-4);
  push.angle_step_rad = table.RequiredNumber("angle_step_mrad", {1e-6, 1000, 1e-3}).value_or(1e-3);
  push.orientation =
      table
          .RequiredOneOf<OrientationConvention>(
              "convention", {{"rotation_vector", OrientationConvention::kRotationVector},
                             {"roll_pitch_yaw", OrientationConvention::kRollPitchYaw},
                             {"abc", OrientationConvention::kAbc}})
          .value_or(push.orientation);
  if (!robot::IsConsistent(push)) {
    table.AddFault("",
                   fmt::format("pose ({} registers), id and sequence overlap or do not fit into "
                               "a slot of {} registers, or the slots end beyond register 65535",
                               robot::PoseWordsOf(push.type), push.stride));
  }
  return push;
}

robot::RobotProfile ReadProfile(const TomlTable& root) {
  robot::RobotProfile profile;
  root.RequiredInteger("schema", 1, 1);
  profile.name = root.RequiredString("name").value_or("");
  profile.source = root.RequiredString("source").value_or("");
  profile.port = root.Integer("port", 1, 65535).value_or(profile.port);
  profile.unit_id = root.Integer("unit_id", 0, 255).value_or(profile.unit_id);
  if (profile.unit_id > 247 && profile.unit_id < 255) {
    root.AddFault("unit_id", "is not 0..247 or 255");
  }
  profile.blocks = ReadBlocks(root);
  const ProfileReader reader(profile.blocks);
  ReadJoints(root, reader, profile.joints);
  if (const auto table = root.Table("tcp")) {
    profile.tcp = ReadPose(*table, reader);
    profile.tcp_is_flange =
        table->OneOf<bool>("of", {{"tool", false}, {"flange", true}}).value_or(false);
  }
  if (const auto table = root.Table("tool_offset")) profile.tool_offset = ReadPose(*table, reader);
  profile.payload_mass = reader.Value(root.Table("payload_mass"), kMassUnits);
  if (const auto table = root.Table("payload_cog")) {
    profile.payload_cog = reader.Three(*table, kLengthUnits);
  }
  if (const auto table = root.Table("temperature")) {
    profile.temperatures = reader.Values(*table, -1, kTemperatureUnits);
    profile.hottest_joint =
        table->OneOf<bool>("combine", {{"mean", false}, {"max", true}}).value_or(false);
  }
  profile.tool_number = reader.Value(root.Table("tool_number"), {});
  profile.payload_item = reader.Value(root.Table("payload_item"), {});
  profile.sequence = reader.Value(root.Table("sequence"), {});
  if (const auto table = root.Table("mode")) ReadMode(*table, reader, profile.mode);
  if (const auto table = root.Table("push")) profile.push = ReadPush(*table);
  return profile;
}

}  // namespace

std::optional<robot::RobotProfile> RobotProfileFromText(std::string_view text,
                                                        const std::string& file,
                                                        FaultList& faults) {
  if (RefuseWrongFile(text, file, kWantedRobotProfile, faults)) return std::nullopt;
  return ReadDocument(text, file, faults,
                      [](TomlDocument& document) { return ReadProfile(document.Root()); });
}

}  // namespace plumbline::config
