#include "app/measure/urdf/urdf_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "app/base/config/xml_document.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::measure {
namespace {

constexpr double kFarthest_m = 100;      // an origin or a centre of mass
constexpr double kLargestAngle = 126;    // rad, 20 turns
constexpr double kLargestMass_kg = 1e4;  // of cell files
constexpr double kAxisTolerance = 1e-3;  // rounding of a unit vector, such as 0.707 0.707 0

/// Reads elements and attributes; every fault is named by element and line, and belongs to the link
/// or joint that is being read.
class UrdfReader {
 public:
  UrdfReader(const config::XmlDocument& document, std::string file, config::FaultList& faults)
      : document_(document), file_(std::move(file)), faults_(faults) {}

  UrdfFile Read();

 private:
  void Fault(const pugi::xml_node& at, const std::string& key, const std::string& what) {
    config::Fault fault{config::Fault::Severity::kFault, file_, document_.LineOf(at), key, what};
    element_ == nullptr ? faults_.Add(std::move(fault)) : element_->push_back(std::move(fault));
  }

  /// Numbers of an attribute within +-limit; `otherwise` if the attribute is absent or faulty.
  std::vector<double> Numbers(const pugi::xml_node& node, const char* attribute,
                              const std::string& key, double limit, std::vector<double> otherwise);
  double Number(const pugi::xml_node& node, const char* attribute, const std::string& key,
                double limit, double otherwise) {
    return Numbers(node, attribute, key, limit, {otherwise}).front();
  }
  Vec3 Vector(const pugi::xml_node& node, const char* attribute, const std::string& key,
              double limit, const Vec3& otherwise) {
    const auto v =
        Numbers(node, attribute, key, limit, {otherwise.x(), otherwise.y(), otherwise.z()});
    return {v[0], v[1], v[2]};
  }
  std::string Name(const pugi::xml_node& node, const char* kind);
  Pose Origin(const pugi::xml_node& element, const std::string& key, Vec3* rpy = nullptr);
  UrdfLink Link(const pugi::xml_node& node);
  UrdfJoint Joint(const pugi::xml_node& node);
  UrdfJoint::Type TypeOf(const pugi::xml_node& node, const std::string& key);
  Vec3 Axis(const pugi::xml_node& joint, const std::string& key);
  std::string LinkOf(const pugi::xml_node& joint, const char* end, const std::string& key);
  void Limits(const pugi::xml_node& node, const std::string& key, UrdfJoint& joint);

  const config::XmlDocument& document_;
  std::string file_;
  config::FaultList& faults_;
  std::vector<config::Fault>* element_ = nullptr;
};

std::vector<double> UrdfReader::Numbers(const pugi::xml_node& node, const char* attribute,
                                        const std::string& key, double limit,
                                        std::vector<double> otherwise) {
  const pugi::xml_attribute given = node.attribute(attribute);
  if (!given) return otherwise;
  const std::string place = fmt::format("{}.{}", key, attribute);
  const auto numbers = config::NumbersFromText(given.value(), otherwise.size());
  if (!numbers) {
    const std::string_view text = given.value();
    if (text.find("${") != std::string_view::npos) {
      Fault(node, place,
            fmt::format("\"{}\" is a xacro expression; expand the file first: xacro FILE > "
                        "robot.urdf",
                        text.substr(0, 60)));
    } else {
      Fault(node, place,
            fmt::format("\"{}\" is not {} finite number{}", text.substr(0, 60), otherwise.size(),
                        otherwise.size() == 1 ? "" : "s separated by blanks"));
    }
    return otherwise;
  }
  for (const double number : *numbers) {
    if (std::abs(number) <= limit) continue;
    Fault(node, place,
          fmt::format("{} is outside -{}..{}; a URDF is in metres, radians and kilograms", number,
                      limit, limit));
    return otherwise;
  }
  return *numbers;
}

std::string UrdfReader::Name(const pugi::xml_node& node, const char* kind) {
  const std::string name = node.attribute("name").value();
  if (name.empty()) Fault(node, kind, "has no name; add name=\"...\"");
  return name;
}

Pose UrdfReader::Origin(const pugi::xml_node& element, const std::string& key, Vec3* rpy) {
  Pose X;
  const pugi::xml_node origin = element.child("origin");
  const std::string place = key + ".origin";
  if (origin.attribute("quat_xyzw")) {
    Fault(origin, place + ".quat_xyzw", "is not read; write the rotation as rpy");
  }
  X.p = Vector(origin, "xyz", place, kFarthest_m, Vec3::Zero());
  const Vec3 angles = Vector(origin, "rpy", place, kLargestAngle, Vec3::Zero());
  X.R = RotationFromRollPitchYaw(angles);
  if (rpy != nullptr) *rpy = angles;
  return X;
}

UrdfLink UrdfReader::Link(const pugi::xml_node& node) {
  UrdfLink link;
  element_ = &link.faults;
  link.name = Name(node, "link");
  link.line = document_.LineOf(node);
  const pugi::xml_node inertial = node.child("inertial");
  const pugi::xml_node mass = inertial.child("mass");
  if (!mass.attribute("value")) return link;
  const std::string key = "link " + link.name;
  const double mass_kg = Number(mass, "value", key + ".mass", kLargestMass_kg, 0);
  if (mass_kg < 0) Fault(mass, key + ".mass.value", fmt::format("{} is negative", mass_kg));
  link.mass_kg = std::max(0.0, mass_kg);
  link.com = Origin(inertial, key + ".inertial").p;
  return link;
}

UrdfJoint::Type UrdfReader::TypeOf(const pugi::xml_node& node, const std::string& key) {
  static constexpr std::array<std::pair<const char*, UrdfJoint::Type>, 6> kTypes{
      {{"fixed", UrdfJoint::Type::kFixed},
       {"revolute", UrdfJoint::Type::kRevolute},
       {"continuous", UrdfJoint::Type::kContinuous},
       {"prismatic", UrdfJoint::Type::kPrismatic},
       {"planar", UrdfJoint::Type::kPlanar},
       {"floating", UrdfJoint::Type::kFloating}}};
  const std::string_view name = node.attribute("type").value();
  for (const auto& [known, type] : kTypes) {
    if (name == known) return type;
  }
  Fault(node, key + ".type",
        fmt::format("\"{}\" is not a joint type; allowed: fixed, revolute, continuous, prismatic",
                    name.substr(0, 60)));
  return UrdfJoint::Type::kUnknown;
}

Vec3 UrdfReader::Axis(const pugi::xml_node& joint, const std::string& key) {
  const pugi::xml_node node = joint.child("axis");
  const Vec3 axis = Vector(node, "xyz", key + ".axis", 1e6, Vec3::UnitX());
  const double length = axis.norm();
  if (std::abs(length - 1) <= kAxisTolerance) return axis / length;
  if (length < 1e-9) {
    Fault(node, key + ".axis.xyz", "is zero: the joint has no direction; write for example 0 0 1");
    return Vec3::UnitX();
  }
  const Vec3 unit = axis / length;
  Fault(node, key + ".axis.xyz",
        fmt::format("has the length {:.6g}; an axis is a unit vector: write {:.9g} {:.9g} {:.9g}",
                    length, unit.x(), unit.y(), unit.z()));
  return unit;
}

std::string UrdfReader::LinkOf(const pugi::xml_node& joint, const char* end,
                               const std::string& key) {
  const std::string name = joint.child(end).attribute("link").value();
  if (name.empty()) Fault(joint, key, fmt::format("has no <{} link=\"...\"/>; add it", end));
  return name;
}

void UrdfReader::Limits(const pugi::xml_node& node, const std::string& key, UrdfJoint& joint) {
  const pugi::xml_node limit = node.child("limit");
  if (!limit || joint.type == UrdfJoint::Type::kContinuous) return;
  const bool prismatic = joint.type == UrdfJoint::Type::kPrismatic;
  const double largest = prismatic ? kFarthest_m : kLargestAngle;
  const model::Interval limits{Number(limit, "lower", key + ".limit", largest, 0),
                               Number(limit, "upper", key + ".limit", largest, 0)};
  if (limit.attribute("lower") || limit.attribute("upper")) joint.limits = limits;
}

UrdfJoint UrdfReader::Joint(const pugi::xml_node& node) {
  UrdfJoint joint;
  element_ = &joint.faults;
  joint.name = Name(node, "joint");
  joint.line = document_.LineOf(node);
  const std::string key = "joint " + joint.name;
  joint.type = TypeOf(node, key);
  joint.type_name = node.attribute("type").value();
  joint.parent = LinkOf(node, "parent", key);
  joint.child = LinkOf(node, "child", key);
  joint.X_PJ = Origin(node, key, &joint.rpy);
  if (!joint.Moves()) return joint;
  if (joint.type != UrdfJoint::Type::kFloating) joint.axis = Axis(node, key);
  Limits(node, key, joint);
  if (const pugi::xml_node mimic = node.child("mimic")) {
    joint.mimics = mimic.attribute("joint").value();
    if (joint.mimics.empty()) Fault(mimic, key + ".mimic", "has no joint=\"...\"; add it");
  }
  joint.rising =
      Number(node.child("calibration"), "rising", key + ".calibration", kLargestAngle, 0);
  return joint;
}

UrdfFile UrdfReader::Read() {
  UrdfFile urdf;
  const pugi::xml_node root = document_.root();
  if (std::string_view(root.name()) != "robot") {
    Fault(root, "", fmt::format("has the root element <{}>; a URDF has <robot>", root.name()));
    return urdf;
  }
  urdf.name = root.attribute("name").value();
  for (const pugi::xml_node& node : root.children()) {
    const std::string_view name = node.name();
    if (name == "link") urdf.links.push_back(Link(node));
    if (name == "joint") urdf.joints.push_back(Joint(node));
    element_ = nullptr;
    if (name.starts_with("xacro:")) {
      Fault(node, "",
            fmt::format("<{}> is a xacro macro; expand the file first: xacro FILE > robot.urdf",
                        name));
      break;
    }
  }
  return urdf;
}

/// Names that two elements have: the fault belongs to both, since either may be meant.
template <typename Element>
void CheckNames(std::vector<Element>& elements, const char* kind, const std::string& file) {
  std::map<std::string_view, Element*> known;
  for (Element& element : elements) {
    if (element.name.empty()) continue;
    const auto [first, added] = known.emplace(element.name, &element);
    if (added) continue;
    const config::Fault fault{
        config::Fault::Severity::kFault, file, element.line,
        fmt::format("{} {}", kind, element.name),
        fmt::format("has the same name as the one in line {}; rename one", first->second->line)};
    first->second->faults.push_back(fault);
    element.faults.push_back(fault);
  }
}

/// Joints between links that exist, and one parent per link.
void CheckReferences(UrdfFile& urdf, const std::string& file) {
  std::map<std::string_view, const UrdfLink*> links;
  for (const UrdfLink& link : urdf.links) links.emplace(link.name, &link);
  std::map<std::string_view, UrdfJoint*> parents;
  for (UrdfJoint& joint : urdf.joints) {
    const auto fault = [&](const std::string& what) {
      return config::Fault{config::Fault::Severity::kFault, file, joint.line, "joint " + joint.name,
                           what};
    };
    for (const std::string* end : {&joint.parent, &joint.child}) {
      if (end->empty() || links.contains(*end)) continue;
      joint.faults.push_back(fault(fmt::format(
          "refers to link \"{}\", which the file does not have; add the link or correct the name",
          *end)));
    }
    const auto [known, added] = parents.emplace(joint.child, &joint);
    if (added || joint.child.empty()) continue;
    known->second->faults.push_back(fault(fmt::format(
        "has the child \"{}\", which already hangs on joint {} (line {}); a link has one parent "
        "joint",
        joint.child, known->second->name, known->second->line)));
  }
}

}  // namespace

std::optional<UrdfFile> UrdfFromText(std::string_view text, const std::string& file,
                                     config::FaultList& faults) {
  config::FaultList own;
  const config::XmlDocument document(text, file, own);
  UrdfFile urdf;
  if (document.parsed()) {
    urdf = UrdfReader(document, file, own).Read();
    if (urdf.links.empty() && !own.HasFaults()) {
      own.Add({config::Fault::Severity::kFault, file, 0, "", "has no <link>; is it a URDF?"});
    }
    CheckNames(urdf.links, "link", file);
    CheckNames(urdf.joints, "joint", file);
    CheckReferences(urdf, file);
  }
  faults.Append(own);
  if (own.HasFaults()) return std::nullopt;
  return urdf;
}

}  // namespace plumbline::measure
