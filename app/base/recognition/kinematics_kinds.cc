// Descriptions of arms, and tables of their kinematics.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

#include "app/base/recognition/kinds.h"

namespace plumbline::recognition {
namespace {

bool IsXml(const Outline& file, std::string_view root) {
  return file.syntax() == Syntax::kXml && !file.entries().empty() &&
         file.entries().front().path == root;
}

/// Something of xacro that was not expanded.
const Entry* XacroOf(const Outline& file) {
  if (file.syntax() != Syntax::kXml) return nullptr;
  for (const Entry& entry : file.entries()) {
    const std::size_t at = entry.path.find_last_of(".@");
    const std::size_t name = at == std::string::npos ? 0 : at + 1;
    const bool element = entry.path.find('@') == std::string::npos &&
                         std::string_view(entry.path).substr(name).starts_with("xacro:");
    const bool expression = entry.path.find('@') != std::string::npos &&
                            (entry.value.find("${") != std::string_view::npos ||
                             entry.value.find("$(") != std::string_view::npos);
    if (element || expression) return &entry;
  }
  return nullptr;
}

void ReadUrdf(const Outline& file, Recognition& found) {
  AddValue(file, "robot@name", "robot", found);
  std::map<std::string, int, std::less<>> types;
  std::set<std::string_view> links, joints;
  std::size_t link_count = 0, joint_count = 0;
  const Entry* first_joint = nullptr;
  for (const Entry& entry : file.entries()) {
    if (entry.path == "robot.link@name") {
      ++link_count;
      if (!links.insert(entry.value).second) {
        Contradict(found, "link", fmt::format("the name {} is given twice", Quoted(entry.value)),
                   entry.line);
      }
    } else if (entry.path == "robot.joint@name") {
      ++joint_count;
      if (!joints.insert(entry.value).second) {
        Contradict(found, "joint", fmt::format("the name {} is given twice", Quoted(entry.value)),
                   entry.line);
      }
      if (first_joint == nullptr) first_joint = &entry;
    } else if (entry.path == "robot.joint@type") {
      ++types[Quoted(entry.value)];
    }
  }
  for (const Entry& entry : file.entries()) {
    const bool end =
        entry.path == "robot.joint.parent@link" || entry.path == "robot.joint.child@link";
    if (!end || links.contains(entry.value) || file.entries_cut()) continue;
    Contradict(found, "joint", fmt::format("link {} does not exist", Quoted(entry.value)),
               entry.line);
    break;
  }
  std::string kinds;
  for (const auto& [type, count] : types) {
    kinds += fmt::format("{}{} {}", kinds.empty() ? "" : ", ", count, type);
  }
  AddFact(found, "links", fmt::format("{}", link_count));
  AddFact(found, "joints", fmt::format("{}: {}", joint_count, kinds),
          first_joint == nullptr ? 0 : first_joint->line);
  AddFact(found, "units", "m, rad, kg; rpy about fixed axes (URDF)");
}

/// Joints without expressions may be read: what remains of xacro may be off the chain.
void ReadXacro(const Outline& file, Recognition& found) {
  AddValue(file, "robot@name", "robot", found);
  if (file.Find("robot.joint.child@link") == nullptr) return;
  found.content = Content::kDescription;
  Contradict(found, "xacro", "was not expanded; joints written with it are missing",
             found.evidence.line);
}

/// Blocks of x y z roll pitch yaw.
void ReadFactoryTable(const Outline& file, Recognition& found) {
  std::vector<std::string> blocks;
  int line = 0;
  for (const Entry& entry : file.entries()) {
    if (!entry.path.starts_with("kinematics.") || !entry.path.ends_with(".x")) continue;
    blocks.push_back(entry.path.substr(11, entry.path.size() - 13));
    if (line == 0) line = entry.line;
    constexpr std::size_t kMost = 16;
    if (blocks.size() == kMost) break;
  }
  for (const std::string& block : blocks) {
    for (const char* const key : {"y", "z", "roll", "pitch", "yaw"}) {
      if (file.Find(fmt::format("kinematics.{}.{}", block, key)) != nullptr) continue;
      Contradict(found, block, fmt::format("{} is missing: the file is cut or damaged", key));
    }
  }
  AddFact(found, "joints", fmt::format("{}: {}", blocks.size(), fmt::join(blocks, ", ")), line);
  AddValue(file, "kinematics.hash", "hash", found);
  AddFact(found, "units", "m, rad");
}

const Entry* FactoryEntry(const Outline& file, std::string_view path) {
  const Entry* const entry = file.syntax() == Syntax::kYaml ? file.Find(path) : nullptr;
  const bool number =
      entry != nullptr && entry->value.find_first_of("0123456789") != std::string_view::npos;
  return number ? entry : nullptr;
}

/// The symbol that the name of a column starts with: "alpha" of "alpha_i [deg]".
std::string DhSymbol(const std::string& name) {
  std::string word = InLowerCase(name);
  word = word.substr(0, word.find_first_of("_ [("));
  if (word == "\u03b1") return "alpha";
  if (word == "\u03b8") return "theta";
  return word;
}

/// Columns a, alpha, d, theta of a table, in any order.
std::optional<Fact> DhHeader(const Outline& file) {
  if (!file.table() || file.table()->header_line == 0) return std::nullopt;
  std::set<std::string> names;
  for (const std::string& name : file.table()->names) names.insert(DhSymbol(name));
  const bool length = names.contains("a") || names.contains("r");
  if (!length || !names.contains("alpha") || !names.contains("d") || !names.contains("theta")) {
    return std::nullopt;
  }
  return Fact{"", Quoted(fmt::format("{}", fmt::join(file.table()->names, " "))),
              file.table()->header_line};
}

void ReadDh(const Outline& file, Recognition& found) {
  const text::DelimitedText& table = *file.table();
  CheckTable(file, table, found);
  AddFact(found, "joints", fmt::format("{} rows", table.records.size()),
          table.records.empty() ? 0 : table.records.front().line);
  found.undecided.emplace_back(
      "the convention: standard (dh: a, alpha follow the joint) or modified (mdh: they precede "
      "it)");
  std::vector<std::string> bare;
  std::vector<std::size_t> degrees;
  for (std::size_t k = 0; k < table.names.size(); ++k) {
    const std::string &name = table.names[k], symbol = DhSymbol(name);
    const bool angle = symbol == "alpha" || symbol == "theta";
    const bool quantity = angle || symbol == "a" || symbol == "r" || symbol == "d";
    const bool stated = StatesUnit(name) || (k < table.units.size() && !table.units[k].empty());
    if (quantity && !stated) bare.push_back(name);
    if (angle && stated && InLowerCase(name).find("deg") != std::string::npos) degrees.push_back(k);
  }
  CheckDegrees(table, degrees, found);
  if (!bare.empty()) {
    found.undecided.push_back(
        fmt::format("the units of {}: mm or m, deg or rad", fmt::join(bare, ", ")));
  }
}

constexpr const char* kImportUrdf = "plumbline import-urdf {} --output cell.toml";

constexpr std::array kKinematicsKinds = {
    Kind{"xacro", "a URDF with xacro that is not expanded", Content::kKinematicsOfOthers,
         [](const Outline& file) -> std::optional<Fact> {
           return IsXml(file, "robot") ? Shown(XacroOf(file)) : std::nullopt;
         },
         ReadXacro, "", "Expand it: xacro {} > robot.urdf, then: plumbline import-urdf robot.urdf"},
    Kind{"srdf", "a semantic description of a robot (SRDF of MoveIt)", Content::kKinematicsOfOthers,
         [](const Outline& file) -> std::optional<Fact> {
           if (!IsXml(file, "robot") || file.Find("robot.link") != nullptr) return std::nullopt;
           const Entry* const group = file.Find("robot.group");
           return Shown(group != nullptr ? group : file.Find("robot.disable_collisions"));
         },
         nullptr, "", "It holds no kinematics: give the URDF that belongs to it."},
    Kind{"urdf", "a description of a robot (URDF)", Content::kDescription,
         [](const Outline& file) -> std::optional<Fact> {
           if (!IsXml(file, "robot")) return std::nullopt;
           const Entry* const link = file.Find("robot.link");
           return Shown(link != nullptr ? &file.entries().front() : file.Find("robot.joint"));
         },
         ReadUrdf, kImportUrdf, ""},
    Kind{"sdf", "a description of a robot or world (SDF of Gazebo)", Content::kKinematicsOfOthers,
         [](const Outline& file) -> std::optional<Fact> {
           return IsXml(file, "sdf") ? Shown(&file.entries().front()) : std::nullopt;
         },
         [](const Outline& file, Recognition& found) {
           AddValue(file, "sdf@version", "version", found);
           AddFact(found, "joints",
                   fmt::format(
                       "{}", file.Count("sdf.model.joint") + file.Count("sdf.world.model.joint")));
         },
         "", "Give the URDF that it was made from."},
    Kind{"mjcf", "a model of MuJoCo (MJCF)", Content::kKinematicsOfOthers,
         [](const Outline& file) -> std::optional<Fact> {
           return IsXml(file, "mujoco") ? Shown(&file.entries().front()) : std::nullopt;
         },
         [](const Outline& file, Recognition& found) {
           AddValue(file, "mujoco@model", "model", found);
           AddValue(file, "mujoco.compiler@angle", "angles", found);
         },
         "", "Give the URDF that it was made from."},
    Kind{"ur-kinematics", "a factory calibration of a UR (default_kinematics.yaml)",
         Content::kKinematics,
         [](const Outline& file) { return Shown(FactoryEntry(file, "kinematics.shoulder.x")); },
         ReadFactoryTable, kImportUrdf, ""},
    Kind{"joint-frames", "a factory table of joint frames (xArm)", Content::kKinematics,
         [](const Outline& file) { return Shown(FactoryEntry(file, "kinematics.joint1.x")); },
         ReadFactoryTable, kImportUrdf, ""},
    Kind{"ur-calibration-conf", "a calibration of a UR's controller (calibration.conf)",
         Content::kKinematicsOfOthers,
         [](const Outline& file) { return Shown(file.FindName("delta_theta")); },
         [](const Outline& file, Recognition& found) {
           for (const char* const name : {"delta_theta", "delta_a", "delta_d", "delta_alpha"}) {
             AddValue(file, name, name, found);
           }
           AddFact(found, "units", "rad, m; added to the nominal table");
         },
         "",
         "Extract the calibration with ROS: ros2 launch ur_calibration "
         "calibration_correction.launch.py robot_ip:=ADDRESS target_filename:=kinematics.yaml, "
         "then: plumbline import-urdf kinematics.yaml"},
    Kind{"joint-limits", "joint limits of an arm (ROS)", Content::kKinematicsOfOthers,
         [](const Outline& file) -> std::optional<Fact> {
           return file.syntax() == Syntax::kYaml ? Shown(file.Find("joint_limits")) : std::nullopt;
         },
         nullptr, "", "It holds no kinematics: give the URDF; the limits go into the cell."},
    Kind{"robot-calibration", "results of robot_calibration (ROS)", Content::kCalibrationResult,
         [](const Outline& file) -> std::optional<Fact> {
           if (file.syntax() != Syntax::kYaml) return std::nullopt;
           const Entry* const urdf = file.Find("urdf");
           for (const Entry& entry : file.entries()) {
             if (entry.path.ends_with("_info") && !entry.value.empty()) return Shown(&entry);
           }
           return urdf != nullptr && !urdf->value.empty() ? Shown(urdf) : std::nullopt;
         },
         nullptr, "plumbline import {} --preview", ""},
    Kind{
        "dh-table", "a Denavit-Hartenberg table", Content::kKinematicsOfOthers, DhHeader, ReadDh,
        "",
        "Copy a cell of config/cells and write each row as [[robot.joint]]: a_mm, alpha_deg, d_mm, "
        "theta_offset_deg."},
};

}  // namespace

std::span<const Kind> KinematicsKinds() {
  return kKinematicsKinds;
}

}  // namespace plumbline::recognition
