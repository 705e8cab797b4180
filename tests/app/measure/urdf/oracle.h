// Forward kinematics of a URDF text, straight from its XML and independent of the product.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <pugixml.hpp>
#include <random>
#include <sstream>
#include <string>
#include <vector>

namespace plumbline::test {

inline Eigen::Vector3d Triple(const pugi::xml_node& node, const char* attribute,
                              const Eigen::Vector3d& otherwise) {
  if (!node.attribute(attribute)) return otherwise;
  std::istringstream text(node.attribute(attribute).value());
  Eigen::Vector3d v;
  text >> v[0] >> v[1] >> v[2];
  return v;
}

/// Pose of link `tip` in link `base`; `q` by joint name.
inline Eigen::Isometry3d UrdfTip(const std::string& xml, const std::string& base,
                                 const std::string& tip, const std::map<std::string, double>& q) {
  pugi::xml_document document;
  document.load_string(xml.c_str());
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  std::string link = tip;
  while (link != base) {
    bool found = false;
    for (const pugi::xml_node& joint : document.child("robot").children("joint")) {
      if (joint.child("child").attribute("link").value() != link) continue;
      found = true;
      const Eigen::Vector3d p = Triple(joint.child("origin"), "xyz", Eigen::Vector3d::Zero());
      const Eigen::Vector3d rpy = Triple(joint.child("origin"), "rpy", Eigen::Vector3d::Zero());
      Eigen::Isometry3d own = Eigen::Translation3d(p) *
                              Eigen::AngleAxisd(rpy[2], Eigen::Vector3d::UnitZ()) *
                              Eigen::AngleAxisd(rpy[1], Eigen::Vector3d::UnitY()) *
                              Eigen::AngleAxisd(rpy[0], Eigen::Vector3d::UnitX());
      const std::string type = joint.attribute("type").value();
      const auto position = q.find(joint.attribute("name").value());
      if (type != "fixed" && position != q.end()) {
        const Eigen::Vector3d axis = Triple(joint.child("axis"), "xyz", Eigen::Vector3d::UnitX());
        if (type == "prismatic") {
          own = own * Eigen::Translation3d(position->second * axis.normalized());
        } else {
          own = own * Eigen::AngleAxisd(position->second, axis.normalized());
        }
      }
      X = own * X;
      link = joint.child("parent").attribute("link").value();
      break;
    }
    if (!found) return Eigen::Isometry3d(Eigen::Matrix4d::Constant(NAN));
  }
  return X;
}

/// How successive axes lie to each other in a generated arm.
enum class Axes { kGeneral, kParallel, kNearlyParallel, kCoaxial, kIntersecting };

inline std::string Numbers(const Eigen::Vector3d& v) {
  std::ostringstream text;
  text.precision(17);
  text << v[0] << ' ' << v[1] << ' ' << v[2];
  return text.str();
}

/// An arm of `joints` joints j1.. between links l0.. , a fixed joint in the middle, and a fixed
/// joint to link "tip" at a general pose. Every third joint is prismatic if `slides`.
inline std::string RandomUrdf(std::mt19937& random, int joints, Axes axes, bool slides) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&](double size) {
    return Eigen::Vector3d(size * uniform(random), size * uniform(random), size * uniform(random));
  };
  std::string xml = "<?xml version=\"1.0\"?>\n<robot name=\"random\">\n  <link name=\"l0\"/>\n";
  const auto add = [&](const std::string& name, const std::string& type, const std::string& parent,
                       const std::string& child, const Eigen::Vector3d& xyz,
                       const Eigen::Vector3d& rpy, const Eigen::Vector3d& axis) {
    xml += "  <link name=\"" + child + "\">\n    <inertial>\n      <origin xyz=\"" +
           Numbers(vector(0.1)) + "\"/>\n      <mass value=\"2.5\"/>\n    </inertial>\n  </link>\n";
    xml += "  <joint name=\"" + name + "\" type=\"" + type + "\">\n    <parent link=\"" + parent +
           "\"/>\n    <child link=\"" + child + "\"/>\n    <origin xyz=\"" + Numbers(xyz) +
           "\" rpy=\"" + Numbers(rpy) + "\"/>\n";
    if (type != "fixed") {
      xml += "    <axis xyz=\"" + Numbers(axis) +
             "\"/>\n    <limit lower=\"-2.5\" upper=\"2.4\" effort=\"1\" velocity=\"1\"/>\n";
    }
    xml += "  </joint>\n";
  };
  std::string last = "l0";
  for (int i = 1; i <= joints; ++i) {
    Eigen::Vector3d axis = vector(1).normalized(), xyz = vector(0.6), rpy = vector(3);
    if (axes != Axes::kGeneral) axis = Eigen::Vector3d::UnitZ();
    if (axes == Axes::kParallel || axes == Axes::kCoaxial) rpy = {0, 0, rpy.z()};
    if (axes == Axes::kCoaxial) xyz = {0, 0, xyz.z()};
    if (axes == Axes::kNearlyParallel) rpy = {2e-3 * uniform(random), 1e-5 * uniform(random), 0.3};
    if (axes == Axes::kIntersecting) xyz = {0, 0, xyz.z()};
    if (i == 3) {
      add("bracket", "fixed", last, "bracket_link", vector(0.2), vector(axes == Axes::kGeneral),
          axis);
      last = "bracket_link";
    }
    const std::string link = "l" + std::to_string(i);
    add("j" + std::to_string(i), slides && i % 3 == 0 ? "prismatic" : "revolute", last, link, xyz,
        rpy, axis);
    last = link;
  }
  add("flange", "fixed", last, "tip", vector(0.2), vector(2), Eigen::Vector3d::UnitZ());
  return xml + "</robot>\n";
}

}  // namespace plumbline::test
