#include "tests/simulator/families.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>

namespace simulator {
namespace {

int Integer(Generator& random, int low, int high) {
  return std::uniform_int_distribution<int>(low, high)(random);
}

double Sign(Generator& random) {
  return Integer(random, 0, 1) == 0 ? -1.0 : 1.0;
}

/// `count` joints of 1..n in ascending order; the outermost is excluded if its axis runs
/// through the tip, where it has little effect.
/// The first joint carries no gravity torque if its axis is vertical.
std::vector<int> Joints(int n, int count, Generator& random, int first = 1) {
  std::vector<int> joints;
  for (int i = first; i < n; ++i) joints.push_back(i);
  std::shuffle(joints.begin(), joints.end(), random);
  joints.resize(std::size_t(std::min(count, n - first)));
  std::sort(joints.begin(), joints.end());
  return joints;
}

std::string Name(int joint) {
  return fmt::format("q{}", joint);
}

/// One parameter per joint, of about the given size.
Effect PerJoint(const std::string& id, const std::vector<int>& joints, const std::string& unit,
                double size, bool either_sign, Generator& random) {
  Effect effect{.id = id, .scope = {}, .parameters = {}, .by = {}, .frame = {}, .session = {}};
  for (const int joint : joints) {
    effect.scope.push_back(Name(joint));
    const double value = size * Uniform(random, 0.6, 1.4) * (either_sign ? Sign(random) : 1.0);
    effect.parameters.push_back({Name(joint), value, unit});
  }
  return effect;
}

Effect Plain(const std::string& id, std::vector<Parameter> parameters) {
  return {.id = id,
          .scope = {},
          .parameters = std::move(parameters),
          .by = {},
          .frame = {},
          .session = {}};
}

std::vector<Parameter> Direction(Generator& random, bool planar = false) {
  Eigen::Vector3d v;
  do {
    for (double& c : v) c = Uniform(random, -1, 1);
  } while (v.norm() > 1.0 || v.norm() < 0.2);
  std::vector<Parameter> xyz = {{"x", v.x(), "mm"}, {"y", v.y(), "mm"}};
  if (!planar) xyz.push_back({"z", v.z(), "mm"});
  return xyz;
}

Effect GearPeriodic(const std::vector<int>& joints, Generator& random) {
  Effect effect = Plain("gear_periodic", {});
  for (const int joint : joints) {
    const double cycles[] = {1, 2, 3, 4, 6, 8, 12, 20};
    effect.scope.push_back(Name(joint));
    effect.parameters.push_back({Name(joint) + "_amplitude", Uniform(random, 1e-4, 2e-4), "rad"});
    effect.parameters.push_back({Name(joint) + "_cycles", cycles[Integer(random, 0, 7)], "1/turn"});
    effect.parameters.push_back({Name(joint) + "_phase", Uniform(random, -3.1, 3.1), "rad"});
  }
  return effect;
}

/// Link parameters without an exact equivalent in a frame or a parallel axis: those of the joints
/// between the first and the last.
Effect LinkGeometry(int n, int count, Generator& random) {
  std::vector<std::string> names = {"a1", "alpha1"};
  for (int i = 2; i < n; ++i) {
    if (i != 2) names.emplace_back(fmt::format("d{}", i));
    names.emplace_back(fmt::format("a{}", i));
    names.emplace_back(fmt::format("alpha{}", i));
  }
  std::shuffle(names.begin(), names.end(), random);
  names.resize(std::size_t(count));
  std::sort(names.begin(), names.end());
  Effect effect = Plain("link_geometry", {});
  std::set<std::string> scope;
  for (const std::string& name : names) {
    const bool angle = name.starts_with("alpha");
    effect.parameters.push_back({name,
                                 (angle ? 0.05 : 1.0) * Uniform(random, 0.6, 1.4) * Sign(random),
                                 angle ? "deg" : "mm"});
    scope.insert("q" + name.substr(name.find_first_of("123456789")));
  }
  effect.scope.assign(scope.begin(), scope.end());
  return effect;
}

/// Outer joints coupled to an inboard one.
Effect AxisCoupling(const std::vector<int>& joints, Generator& random) {
  Effect effect = Plain("axis_coupling", {});
  for (const int joint : joints) {
    const int of = Integer(random, 1, joint - 1);
    effect.scope.push_back(Name(joint));
    effect.parameters.push_back({fmt::format("{}_of_q{}", Name(joint), of),
                                 1e-3 * Uniform(random, 0.6, 1.4) * Sign(random), "1"});
  }
  return effect;
}

/// Two adjacent axes declared parallel, rotated about the direction that alpha does not cover.
Effect ParallelAxis(const Cell& cell, Generator& random) {
  std::vector<int> parallel;
  const int n = int(cell.joints.size());
  for (int i = 1; i <= n; ++i) {
    const bool between = cell.proximal ? i > 1 : i < n;
    if (between && std::abs(std::sin(cell.joints[i - 1].alpha_rad)) < 0.02) parallel.push_back(i);
  }
  if (parallel.empty()) throw std::runtime_error("parallel_axis: this arm has no parallel axes");
  const int link = parallel[std::size_t(Integer(random, 0, int(parallel.size()) - 1))];
  Effect effect = Plain(
      "link_geometry",
      {{fmt::format("beta{}", link), 0.05 * Uniform(random, 0.6, 1.4) * Sign(random), "deg"}});
  effect.scope = {Name(link)};
  return effect;
}

Effect StepEvent(Generator& random, double duration_s) {
  Effect step = Plain("step_event", Direction(random));
  step.parameters.push_back({"time", Uniform(random, 0.3, 0.7) * duration_s, "s", true});
  step.frame = Integer(random, 0, 1) == 0 ? "base" : "tool";
  return step;
}

/// Half of them at the change from the first to the second of two sessions.
Effect OffsetEvent(const std::vector<int>& joints, Generator& random, double duration_s) {
  Effect event = PerJoint("offset_event", joints, "rad", 1e-3, true, random);
  const double share = Integer(random, 0, 1) == 0 ? 0.5 : Uniform(random, 0.3, 0.7);
  event.parameters.push_back({"time", share * duration_s, "s", true});
  return event;
}

/// The joints of one type, numbered from 1.
std::vector<int> JointsOfType(const Cell& cell, bool prismatic) {
  std::vector<int> joints;
  for (std::size_t i = 0; i < cell.joints.size(); ++i) {
    if (cell.joints[i].prismatic == prismatic) joints.push_back(int(i) + 1);
  }
  return joints;
}

/// Bearings except the first, which is equivalent to the pedestal.
Effect BearingTilt(const Cell& cell, int count, Generator& random) {
  std::vector<int> joints = JointsOfType(cell, false);
  std::erase(joints, 1);
  std::shuffle(joints.begin(), joints.end(), random);
  joints.resize(std::min(joints.size(), std::size_t(count)));
  std::sort(joints.begin(), joints.end());
  return PerJoint("bearing_tilt", joints, "rad/(N m)", 1e-7, false, random);
}

/// One of the links longer than 0.2 m warms up.
Effect LinkWarmup(const Cell& cell, Generator& random) {
  std::vector<int> links;
  for (std::size_t i = 0; i < cell.joints.size(); ++i) {
    const Joint& link = cell.joints[i];
    if (std::max(std::abs(link.a_m), std::abs(link.d_m)) >= 0.2) links.push_back(int(i) + 1);
  }
  const int link = links[std::size_t(Integer(random, 0, int(links.size()) - 1))];
  Effect effect = Plain("link_warmup", {{"growth", 3e-4 * Uniform(random, 0.6, 1.4), "1"},
                                        {"tau", Uniform(random, 600, 3000), "s"}});
  effect.scope = {Name(link)};
  return effect;
}

/// Links of nonzero length; the others have no effect.
Effect LinkBending(const Cell& cell, int count, Generator& random) {
  std::vector<std::string> names;
  const int n = int(cell.joints.size());
  for (int i = 1; i <= n; ++i) {
    if (cell.proximal && i == n) continue;
    const Joint& link = cell.joints[std::size_t(cell.proximal ? i : i - 1)];
    if (std::hypot(link.a_m, link.d_m) < 0.2) continue;
    names.push_back(Name(i));
    names.push_back(Name(i) + "_torsion");
  }
  std::shuffle(names.begin(), names.end(), random);
  names.resize(std::min(names.size(), std::size_t(count)));
  std::sort(names.begin(), names.end());
  Effect effect = Plain("link_bending", {});
  std::set<std::string> scope;
  for (const std::string& name : names) {
    effect.parameters.push_back({name, 1e-7 * Uniform(random, 0.6, 1.4), "rad/(N m)"});
    scope.insert(name.substr(0, name.find('_')));
  }
  effect.scope.assign(scope.begin(), scope.end());
  return effect;
}

/// A compliant joint that carries tool, payload and links of unknown weight.
Effect GravitySag(const Cell& cell, Generator& random) {
  const int joint = Integer(random, 2, 3);
  Effect effect = Plain("gravity_sag", {{Name(joint), 1e-6, "rad/(N m)"}});
  for (int link = joint; link <= std::min(joint + 1, int(cell.joints.size())); ++link) {
    effect.parameters.push_back(
        {fmt::format("{}_link{}_{}", Name(joint), link, Integer(random, 0, 1) == 0 ? "x" : "y"),
         1e-3 * Uniform(random, 0.6, 1.4) * Sign(random), "rad"});
  }
  effect.scope = {Name(joint)};
  return effect;
}

/// A guide with play on a slide of the lift robot: the first, vertical, carries moments about both
/// transverse axes, the second, horizontal, about its x axis only.
Effect GuidePlay(const std::vector<int>& slides, Generator& random) {
  const int slide = slides[std::size_t(Integer(random, 0, int(slides.size()) - 1))];
  std::vector<std::string> axes = {"x"};
  if (slide == slides.front()) {
    const int drawn = Integer(random, 0, 2);
    if (drawn == 1) axes = {"y"};
    if (drawn == 2) axes = {"x", "y"};
  }
  Effect effect = Plain("guide_play", {});
  for (const std::string& axis : axes) {
    effect.parameters.push_back(
        {Name(slide) + "_" + axis, 3e-4 * Uniform(random, 0.6, 1.4), "rad"});
  }
  effect.scope = {Name(slide)};
  return effect;
}

/// Structural effects and rotations of the base.
std::optional<Effect> OfStructure(const std::string& id, const Cell& cell, int count,
                                  Generator& random) {
  if (id == "bearing_tilt") return BearingTilt(cell, std::min(count, 2), random);
  if (id == "link_bending") return LinkBending(cell, std::min(count, 2), random);
  if (id == "gravity_sag") return GravitySag(cell, random);
  if (id == "base_tilt") return Plain(id, {{"gain", 1.0, "1"}});
  if (id == "tilt_event") {
    Effect event = Plain(id, Direction(random, true));
    for (Parameter& p : event.parameters) p = {p.name, 0.02 * p.value, "deg"};
    event.parameters.push_back({"time", Uniform(random, 0.3, 0.7) * 5400.0, "s", true});
    return event;
  }
  if (id == "range_zero") return Plain(id, {{"zero", Sign(random), "mm"}});
  if (id == "range_anchor") return Plain(id, Direction(random));
  const std::vector<int> slides = JointsOfType(cell, true);
  if (slides.empty()) return std::nullopt;
  if (id == "slide_compliance") {
    return PerJoint("joint_compliance", {slides.front()}, "m/N", 1e-8, false, random);
  }
  if (id == "guide_play") return GuidePlay(slides, random);
  if (id == "axis_bending") return PerJoint(id, {slides.back()}, "1/(N m^2)", 1e-7, false, random);
  return std::nullopt;
}

/// Effects of the last move, of coupled axes and of parallel axes.
Effect OfMoves(const std::string& id, const Cell& cell, int count, Generator& random) {
  const int n = int(cell.joints.size());
  if (id == "following_error") {
    return PerJoint(id, Joints(n, count, random), "rad", 2e-4, true, random);
  }
  if (id == "arrival_friction") {
    return PerJoint(id, Joints(n, count, random, 2), "rad/(N m)", 1e-6, false, random);
  }
  if (id == "axis_coupling") return AxisCoupling(Joints(n, std::min(count, 2), random, 2), random);
  if (id == "parallel_axis") return ParallelAxis(cell, random);
  throw std::runtime_error("no family " + id + "; --list names them");
}

Effect Catalogued(const std::string& id, const Cell& cell, Generator& random) {
  const int n = int(cell.joints.size());
  const int count = Integer(random, 1, 3);
  const auto joints = [&](int how_many) { return Joints(n, how_many, random); };
  const auto loaded_joints = [&] { return Joints(n, count, random, 2); };
  if (id == "base_frame") {
    Effect effect = Plain(id, Direction(random));
    for (const char* name : {"roll", "pitch", "yaw"}) {
      effect.parameters.push_back({name, Uniform(random, -0.03, 0.03), "deg"});
    }
    return effect;
  }
  if (id == "tool_frame" || id == "payload_cog") return Plain(id, Direction(random));
  if (id == "joint_offset") return PerJoint(id, joints(count), "rad", 1e-3, true, random);
  if (id == "gear_ratio") return PerJoint(id, joints(count), "1", 1e-3, true, random);
  if (id == "link_geometry") return LinkGeometry(n, count, random);
  if (id == "joint_compliance") {
    Effect effect = PerJoint(id, loaded_joints(), "rad/(N m)", 1.0, false, random);
    for (Parameter& p : effect.parameters) {
      p.value *= cell.joints[std::stoi(p.name.substr(1)) - 1].compliance_rad_per_Nm.value_or(1e-6);
    }
    return effect;
  }
  if (id == "joint_hardening") {
    // Only heavily loaded joints show it: the second to the fourth.
    std::vector<int> loaded = {2, 3, 5};
    std::shuffle(loaded.begin(), loaded.end(), random);
    loaded.resize(std::size_t(std::min(count, 2)));
    std::sort(loaded.begin(), loaded.end());
    Effect effect = PerJoint(id, loaded, "rad/(N m)^3", 1e-16, false, random);
    for (Parameter& p : effect.parameters) {
      const double c =
          cell.joints[std::stoi(p.name.substr(1)) - 1].compliance_rad_per_Nm.value_or(1e-6);
      p.value *= c * c * c / 1e-18;  // the coefficient scales with the cube of the compliance
    }
    return effect;
  }
  if (id == "compliance_asymmetry") {
    // The gravity torque of the last joint but one has both directions in random poses.
    return PerJoint(id, {std::max(1, n - 1)}, "rad/(N m)", 1e-7, true, random);
  }
  if (id == "offset_event") return OffsetEvent(joints(std::min(count, 2)), random, 5400.0);
  if (id == "counterbalance") {
    return {.id = id,
            .scope = {"q2"},
            .parameters = {{"q2_amplitude", 1000.0, "N m"},
                           {"q2_phase", Uniform(random, -3.1, 3.1), "rad"}},
            .by = {},
            .frame = {},
            .session = {}};
  }
  if (id == "tool_stiffness") return Plain(id, {{"ratio", 0.2 * Sign(random), "1"}});
  if (id == "tool_shear") return Plain(id, {{"kappa", 0.5, "1"}});
  if (id == "tool_root_compliance") return Plain(id, {{"compliance", 1e-6, "rad/(N m)"}});
  if (id == "payload_mass") {
    return Integer(random, 0, 1) == 0 ? Plain(id, {{"scale", 0.1 * Sign(random), "1"}})
                                      : Plain(id, {{"constant", 2.0, "kg"}});
  }
  if (id == "gravity_direction") {
    return Plain(id, {{"x", Uniform(random, -1e-2, 1e-2), "rad"},
                      {"y", Uniform(random, -1e-2, 1e-2), "rad"}});
  }
  if (id == "pedestal_compliance") return Plain(id, {{"compliance", 1e-8, "rad/(N m)"}});
  if (id == "backlash_load" || id == "backlash_move") {
    Effect effect = PerJoint("backlash", id == "backlash_move" ? joints(count) : loaded_joints(),
                             "rad", 2e-4, false, random);
    effect.by = id == "backlash_move" ? "move" : "load";
    return effect;
  }
  if (id == "approach_lag") return PerJoint(id, joints(count), "1", 2e-4, false, random);
  if (id == "gear_periodic") return GearPeriodic(joints(std::min(count, 2)), random);
  if (id == "thermal_growth") return Plain(id, {{"alpha", 1.2e-5, "1/K"}});
  if (id == "thermal_drift") {
    Effect effect = Plain(id, Direction(random));
    effect.parameters.push_back({"time_constant", Uniform(random, 600, 2500), "s"});
    return effect;
  }
  if (id == "latency") return Plain(id, {{"time", 1e-3, "s"}});
  if (id == "dynamic_inertia") return PerJoint(id, joints(count), "s^2", 1e-4, false, random);
  if (id == "measurement_scale") return Plain(id, {{"scale", 1e-4 * Sign(random), "1"}});
  if (id == "step_event") return StepEvent(random, 5400.0);
  if (id == "camera_tag_size") return Plain(id, {{"scale", 1e-3 * Sign(random), "1"}});
  if (id == "camera_lens") return Plain(id, {{"k1", 1e-2 * Sign(random), "1"}});
  if (id == "camera_zoom") {
    Effect zoom = Plain(id, {{"scale", 1e-3 * Sign(random), "1"}});
    if (Integer(random, 0, 1) == 1)
      zoom.parameters.push_back({"time", Uniform(random, 0.3, 0.7) * 5400.0, "s", true});
    return zoom;
  }
  if (const std::optional<Effect> found = OfStructure(id, cell, count, random)) return *found;
  return OfMoves(id, cell, count, random);
}

const std::vector<std::string> kCatalogued = {
    "base_frame",      "tool_frame",        "joint_offset",         "gear_ratio",
    "link_geometry",   "joint_compliance",  "joint_hardening",      "counterbalance",
    "tool_stiffness",  "tool_shear",        "tool_root_compliance", "payload_mass",
    "payload_cog",     "gravity_direction", "pedestal_compliance",  "backlash_load",
    "backlash_move",   "approach_lag",      "gear_periodic",        "thermal_growth",
    "thermal_drift",   "latency",           "dynamic_inertia",      "measurement_scale",
    "step_event",      "camera_tag_size",   "camera_zoom",          "camera_lens",
    "following_error", "arrival_friction",  "axis_coupling",        "parallel_axis",
    "bearing_tilt",    "link_bending",      "gravity_sag",          "tilt_event",
    "base_tilt",       "range_zero",        "range_anchor",         "compliance_asymmetry",
    "offset_event"};

const std::vector<std::string> kOutside = {"creep",
                                           "link_warmup",
                                           "slow_sine",
                                           "payload_squared",
                                           "temperature_squared",
                                           "two_bumps",
                                           "velocity_squared",
                                           "air_pressure",
                                           "two_drivers",
                                           "temperature_payload",
                                           "temperature_payload_joint"};

/// Candidates for families with several effects.
const std::vector<std::string> kUsual = {
    "joint_offset",  "joint_compliance",    "tool_stiffness", "backlash_load",
    "backlash_move", "thermal_growth",      "gear_periodic",  "payload_mass",
    "thermal_drift", "pedestal_compliance", "gear_ratio",     "tool_frame",
    "step_event",    "link_geometry",       "payload_cog",    "tool_root_compliance"};

bool Contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

Hidden Outside(const std::string& family, const Cell& cell, Generator& random) {
  Hidden hidden;
  hidden.family = family;
  hidden.in_catalogue = false;
  const int joint = Joints(int(cell.joints.size()), 1, random)[0];
  if (family == "creep") {
    hidden.effects = {Plain(family, {{"A", 0.2, "1"}, {"tau", Uniform(random, 300, 900), "s"}})};
    hidden.drivers = {"t_s"};
  } else if (family == "link_warmup") {
    hidden.effects = {LinkWarmup(cell, random)};
    hidden.drivers = {"t_s"};
  } else if (family == "slow_sine") {
    Effect sine = Plain(family, Direction(random));
    sine.parameters.push_back({"period", Uniform(random, 1200, 3600), "s"});
    sine.parameters.push_back({"phase", Uniform(random, -3.1, 3.1), "rad"});
    hidden.effects = {sine};
    hidden.drivers = {"t_s"};
  } else if (family == "payload_squared") {
    hidden.effects = {Plain(family, {{"per_kg", 0.2 / cell.payloads_kg.back(), "1/kg"}})};
    hidden.drivers = {"payload_kg"};
  } else if (family == "temperature_squared") {
    hidden.effects = {Plain(family, {{"per_K2", 0.01, "mm/K^2"}})};
    hidden.drivers = {"temp_C"};
  } else if (family == "two_bumps") {
    Effect bumps = Plain(family, {{"amplitude", 2e-4, "rad"},
                                  {"centre", 0.0, "rad"},
                                  {"width", Uniform(random, 0.15, 0.3), "rad"},
                                  {"second", Uniform(random, 0.8, 1.5), "rad"}});
    const Joint& j = cell.joints[std::size_t(joint - 1)];
    bumps.parameters[1].value = j.min_rad + Uniform(random, 0.2, 0.4) * (j.max_rad - j.min_rad);
    bumps.parameters[3].value = std::min(bumps.parameters[3].value, 0.4 * (j.max_rad - j.min_rad));
    bumps.scope = {Name(joint)};
    hidden.effects = {bumps};
    hidden.drivers = {fmt::format("q{}_deg", joint)};
  } else if (family == "velocity_squared") {
    hidden.effects = {PerJoint(family, {joint}, "s^2/rad", 1e-4, false, random)};
    hidden.drivers = {fmt::format("qd{}_deg_s", joint)};
  } else if (family == "two_drivers") {
    Effect weather = Plain(family, {});
    for (const char term : {'p', 't', 'm'}) {
      for (Parameter p : Direction(random)) {
        p.name = term + p.name;
        weather.parameters.push_back(p);
      }
    }
    hidden.effects = {weather};
    hidden.drivers = {"air_pressure_bar", "temp_C"};
  } else if (family == "temperature_payload_joint") {
    hidden.effects = {PerJoint(family, {joint}, "rad/(K kg)", 1e-6, true, random)};
    hidden.drivers = {"temp_C", "payload_kg"};
  } else if (family == "temperature_payload") {
    hidden.effects = {Plain(family, Direction(random))};
    for (Parameter& p : hidden.effects[0].parameters) {
      p.value *= 0.1 / cell.payloads_kg.back();
      p.unit = "mm/(K kg)";
    }
    hidden.drivers = {"temp_C", "payload_kg"};
  } else {
    hidden.effects = {Plain(family, Direction(random))};
    for (Parameter& p : hidden.effects[0].parameters) p.unit = "mm/bar";
    hidden.drivers = {"air_pressure_bar"};
  }
  return hidden;
}

const std::map<std::string, int> kSeveral = {{"pair", 2}, {"three", 3}, {"four", 4}};

/// `count` distinct names from kUsual.
std::vector<std::string> Distinct(int count, Generator& random) {
  const int first = Integer(random, 0, int(kUsual.size()) - 1);
  std::vector<std::string> names = {kUsual[std::size_t(first)]};
  int at = first;
  while (int(names.size()) < count) {
    at = (at + Integer(random, 1, int(kUsual.size()) - 1)) % int(kUsual.size());
    if (!Contains(names, kUsual[std::size_t(at)])) names.push_back(kUsual[std::size_t(at)]);
  }
  return names;
}

/// Effects given as "A+B@q2,q3+C"; those with given joints are redrawn until the joints match.
Effects Named(std::string family, const Cell& cell, Generator& random) {
  if (family.starts_with("pair:")) family.erase(0, 5);
  Effects effects;
  std::istringstream names(family);
  for (std::string name; std::getline(names, name, '+');) {
    const std::size_t at = name.find('@');
    const std::string wanted = at == std::string::npos ? "" : name.substr(at + 1);
    for (int attempt = 0;; ++attempt) {
      const Effect effect = Catalogued(name.substr(0, at), cell, random);
      if (wanted.empty() || fmt::format("{}", fmt::join(effect.scope, ",")) == wanted) {
        effects.push_back(effect);
        break;
      }
      if (attempt == 10000) throw std::runtime_error("never drawn with these joints: " + name);
    }
  }
  return effects;
}

bool IsSize(const Parameter& parameter) {
  static const std::set<std::string> kNot = {"time_constant", "tau",   "period", "phase",
                                             "centre",        "width", "second"};
  return !parameter.fixed && !kNot.contains(parameter.name) &&
         parameter.name.find("_cycles") == std::string::npos &&
         parameter.name.find("_phase") == std::string::npos;
}

}  // namespace

std::vector<std::string> Families() {
  std::vector<std::string> names = {"none"};
  names.insert(names.end(), kCatalogued.begin(), kCatalogued.end());
  names.emplace_back("rigid_declared");
  names.insert(names.end(), kOutside.begin(), kOutside.end());
  for (const auto& [name, count] : kSeveral) names.push_back(name);
  return names;
}

bool NeedsVelocities(const std::string& family) {
  for (const char* name : {"latency", "dynamic_inertia", "velocity_squared"}) {
    if (family.find(name) != std::string::npos) return true;
  }
  return false;
}

bool NeedsCamera(const std::string& family) {
  return family.find("camera_") != std::string::npos;
}

bool NeedsTilt(const std::string& family) {
  return family.find("base_tilt") != std::string::npos;
}

bool NeedsUnknownMasses(const std::string& family) {
  return family.find("gravity_sag") != std::string::npos;
}

bool NeedsRange(const std::string& family) {
  return family.starts_with("range_");
}

bool NeedsPressure(const std::string& family) {
  return family == "air_pressure" || family == "two_drivers";
}

Hidden DrawFamily(const std::string& family, const Cell& cell, Generator& random) {
  Hidden hidden;
  hidden.family = family;
  if (family == "none") return hidden;
  if (Contains(kOutside, family)) return Outside(family, cell, random);
  if (family == "rigid_declared") {
    hidden.rigid_declared = true;
    Effect all = Plain("joint_compliance", {});
    for (std::size_t i = 0; i < cell.joints.size(); ++i) {
      const std::string name = Name(int(i) + 1);
      all.scope.push_back(name);
      all.parameters.push_back(
          {name, cell.joints[i].compliance_rad_per_Nm.value_or(0.0) * Uniform(random, 0.5, 1.1),
           "rad/(N m)"});
    }
    hidden.effects = {all};
    return hidden;
  }
  if (const auto several = kSeveral.find(family); several != kSeveral.end()) {
    for (const std::string& id : Distinct(several->second, random)) {
      hidden.effects.push_back(Catalogued(id, cell, random));
    }
    return hidden;
  }
  hidden.effects = Named(family, cell, random);
  return hidden;
}

double Signal(const Cell& cell, const Effects& effects, const std::vector<Row>& rows) {
  const Eigen::VectorXd moved = Readings(cell, effects, rows) - Readings(cell, {}, rows);
  return moved.norm() / std::sqrt(double(moved.size())) * 1e-3 / cell.sigma_m;
}

void ScaleTo(double signal, const Cell& cell, const std::vector<Row>& rows, Effects& effects) {
  for (Effect& effect : effects) {
    for (int iteration = 0; iteration < 12; ++iteration) {
      const double now = Signal(cell, {effect}, rows);
      if (!(now > 0.0)) break;
      double factor = std::clamp(signal / now, 0.3, 3.0);
      if (effect.id == "tool_shear") factor = 1.0 / factor;
      for (Parameter& p : effect.parameters) {
        if (!IsSize(p)) continue;
        p.value *= factor;
        if (effect.id == "tool_stiffness") p.value = std::clamp(p.value, -0.7, 3.0);
      }
    }
  }
}

}  // namespace simulator
