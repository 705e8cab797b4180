#include "tests/simulator/effect.h"

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "tests/simulator/cell.h"

namespace simulator {
namespace {

double Value(const Effect& effect, const std::string& name) {
  for (const Parameter& parameter : effect.parameters) {
    if (parameter.name == name) return parameter.value;
  }
  return 0.0;
}

Eigen::Vector3d Xyz(const Effect& effect) {
  return {Value(effect, "x"), Value(effect, "y"), Value(effect, "z")};
}

/// 0-based joint of "q3", "q3_2_phase", "alpha3".
int JointOf(const std::string& name) {
  return std::stoi(name.substr(name.find_first_of("123456789"))) - 1;
}

bool EndsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

}  // namespace

nlohmann::json ToJson(const Effects& effects) {
  nlohmann::json list = nlohmann::json::array();
  for (const Effect& effect : effects) {
    nlohmann::json parameters = nlohmann::json::array();
    for (const Parameter& p : effect.parameters) {
      parameters.push_back({{"name", p.name}, {"value", p.value}, {"unit", p.unit}});
      if (p.fixed) parameters.back()["fixed"] = true;
    }
    list.push_back({{"id", effect.id}, {"scope", effect.scope}, {"parameters", parameters}});
    if (!effect.by.empty()) list.back()["by"] = effect.by;
    if (!effect.frame.empty()) list.back()["frame"] = effect.frame;
    if (!effect.session.empty()) list.back()["session"] = effect.session;
  }
  return list;
}

Effects EffectsFromJson(const nlohmann::json& list) {
  Effects effects;
  for (const nlohmann::json& item : list) {
    Effect effect;
    effect.id = item.at("id").get<std::string>();
    effect.scope = item.value("scope", std::vector<std::string>());
    effect.by = item.value("by", std::string());
    effect.frame = item.value("frame", std::string());
    effect.session = item.value("session", std::string());
    for (const nlohmann::json& p : item.at("parameters")) {
      effect.parameters.push_back({p.at("name").get<std::string>(), p.at("value").get<double>(),
                                   p.value("unit", std::string()), p.value("fixed", false)});
    }
    effects.push_back(effect);
  }
  return effects;
}

Changes::Changes(int joints) {
  for (Eigen::VectorXd* vector : {&offset,       &gear_ratio,    &compliance,
                                  &hardening,    &backlash_load, &backlash_move,
                                  &lag,          &inertia,       &viscous_squared,
                                  &warm_payload, &following,     &friction,
                                  &a_m,          &d_m,           &alpha_rad,
                                  &beta_rad,     &bearing,       &link_bending,
                                  &link_torsion, &axis_bending,  &guide_x,
                                  &guide_y,      &asymmetry}) {
    vector->setZero(joints);
  }
  coupling.setZero(joints, joints);
}

Changes::Changes(const Effects& effects, int joints) : Changes(joints) {
  for (const Effect& effect : effects) Add(effect);
}

/// Structural deflection and joints under unknown weight.
/// @return  true if the effect is one of these
bool Changes::AddStructure(const Effect& effect) {
  const std::string& id = effect.id;
  if (id != "bearing_tilt" && id != "link_bending" && id != "axis_bending" && id != "guide_play" &&
      id != "gravity_sag") {
    return false;
  }
  for (const Parameter& p : effect.parameters) {
    const int joint = JointOf(p.name);
    const std::size_t link = p.name.find("_link");
    if (link != std::string::npos) {
      sags.push_back({joint, JointOf(p.name.substr(link)), p.name.back() - 'x', p.value});
    } else if (id == "gravity_sag") {
      compliance[joint] += p.value;
    } else if (id == "bearing_tilt") {
      bearing[joint] += p.value;
    } else if (id == "axis_bending") {
      axis_bending[joint] += p.value;
    } else if (id == "guide_play") {
      (EndsWith(p.name, "_x") ? guide_x : guide_y)[joint] += p.value;
    } else {
      (EndsWith(p.name, "_torsion") ? link_torsion : link_bending)[joint] += p.value;
    }
  }
  return true;
}

/// Tilting base and range errors. @return true if the effect is one of these
bool Changes::AddReading(const Effect& effect) {
  if (effect.id == "tilt_event") {
    tilts.push_back(
        {Value(effect, "time"), Eigen::Vector2d(Value(effect, "x"), Value(effect, "y")) * kDeg});
  } else if (effect.id == "base_tilt") {
    tilt_gain += Value(effect, "gain");
  } else if (effect.id == "range_zero") {
    range_zero_m += Value(effect, "zero") * 1e-3;
  } else if (effect.id == "range_anchor") {
    anchor_m += Xyz(effect) * 1e-3;
  } else {
    return false;
  }
  return true;
}

void Changes::Add(const Effect& effect) {
  const std::string& id = effect.id;
  const auto each_joint = [&](Eigen::VectorXd& target) {
    for (const Parameter& p : effect.parameters) target[JointOf(p.name)] += p.value;
  };
  if (id == "base_frame") {
    frames.push_back(
        {effect.session, Xyz(effect) * 1e-3,
         Eigen::Vector3d(Value(effect, "roll"), Value(effect, "pitch"), Value(effect, "yaw")) *
             kDeg,
         Eigen::Vector3d::Zero()});
  } else if (id == "tool_frame") {
    frames.push_back(
        {effect.session, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Xyz(effect) * 1e-3});
  } else if (id == "joint_offset") {
    each_joint(offset);
  } else if (id == "gear_ratio") {
    each_joint(gear_ratio);
  } else if (id == "link_geometry") {
    for (const Parameter& p : effect.parameters) {
      const int joint = JointOf(p.name);
      if (p.name.starts_with("alpha")) {
        alpha_rad[joint] += p.value * kDeg;
      } else if (p.name.starts_with("beta")) {
        beta_rad[joint] += p.value * kDeg;
      } else {
        (p.name[0] == 'a' ? a_m : d_m)[joint] += p.value * 1e-3;
      }
    }
  } else if (id == "joint_compliance") {
    each_joint(compliance);
  } else if (id == "joint_hardening") {
    each_joint(hardening);
  } else if (id == "compliance_asymmetry") {
    each_joint(asymmetry);
  } else if (id == "offset_event") {
    for (const Parameter& p : effect.parameters) {
      if (p.name != "time") jumps.push_back({Value(effect, "time"), JointOf(p.name), p.value});
    }
  } else if (id == "counterbalance") {
    counterbalance_Nm += Value(effect, "q2_amplitude");
    counterbalance_phase_rad = Value(effect, "q2_phase");
  } else if (id == "tool_stiffness") {
    tool_ratio += Value(effect, "ratio");
  } else if (id == "tool_shear") {
    shear_kappa = Value(effect, "kappa");
  } else if (id == "tool_root_compliance") {
    root_compliance += Value(effect, "compliance");
  } else if (id == "payload_mass") {
    mass_scale += Value(effect, "scale");
    mass_constant_kg += Value(effect, "constant");
  } else if (id == "payload_cog") {
    cog_m += Xyz(effect) * 1e-3;
  } else if (id == "gravity_direction") {
    gravity_rad += Eigen::Vector2d(Value(effect, "x"), Value(effect, "y"));
  } else if (id == "pedestal_compliance") {
    pedestal += Value(effect, "compliance");
  } else if (id == "backlash") {
    each_joint(effect.by == "move" ? backlash_move : backlash_load);
  } else if (id == "approach_lag") {
    each_joint(lag);
  } else if (id == "following_error") {
    each_joint(following);
  } else if (id == "arrival_friction") {
    each_joint(friction);
  } else if (id == "axis_coupling") {
    for (const Parameter& p : effect.parameters) {
      coupling(JointOf(p.name), JointOf(p.name.substr(p.name.find("_of_")))) += p.value;
    }
  } else if (id == "gear_periodic") {
    for (const Parameter& p : effect.parameters) {
      if (!EndsWith(p.name, "_amplitude")) continue;
      const std::string stem = p.name.substr(0, p.name.size() - 10);
      periodics.push_back({JointOf(p.name), p.value, Value(effect, stem + "_cycles"),
                           Value(effect, stem + "_phase")});
    }
  } else if (id == "thermal_growth") {
    thermal_per_K += Value(effect, "alpha");
  } else if (id == "thermal_drift") {
    drifts.push_back({Xyz(effect) * 1e-3, Value(effect, "time_constant")});
  } else if (id == "latency") {
    latency_s += Value(effect, "time");
  } else if (id == "dynamic_inertia") {
    each_joint(inertia);
  } else if (id == "measurement_scale") {
    scale += Value(effect, "scale");
  } else if (id == "camera_tag_size") {
    tag_size += Value(effect, "scale");
  } else if (id == "camera_zoom") {
    zooms.push_back({Value(effect, "time"), Value(effect, "scale")});
  } else if (id == "camera_lens") {
    lens_k1 += Value(effect, "k1");
  } else if (id == "step_event") {
    steps.push_back({Value(effect, "time"), Xyz(effect) * 1e-3, effect.frame == "tool"});
  } else if (AddStructure(effect) || AddReading(effect)) {
    return;
  } else if (id == "creep") {
    creep += Value(effect, "A");
    creep_tau_s = Value(effect, "tau");
  } else if (id == "link_warmup") {
    warmups.push_back({JointOf(effect.scope.at(0)), Value(effect, "growth"), Value(effect, "tau")});
  } else if (id == "slow_sine") {
    sine_m += Xyz(effect) * 1e-3;
    sine_period_s = Value(effect, "period");
    sine_phase_rad = Value(effect, "phase");
  } else if (id == "payload_squared") {
    bending_per_kg += Value(effect, "per_kg");
  } else if (id == "temperature_squared") {
    growth_mm_per_K2 += Value(effect, "per_K2");
  } else if (id == "two_bumps") {
    bumps.push_back({JointOf(effect.scope.at(0)), Value(effect, "amplitude"),
                     Value(effect, "centre"), Value(effect, "width"), Value(effect, "second")});
  } else if (id == "velocity_squared") {
    each_joint(viscous_squared);
  } else if (id == "two_drivers") {
    for (const Parameter& p : effect.parameters) {
      const std::size_t term = p.name[0] == 'p' ? 0 : p.name[0] == 't' ? 1 : 2;
      weather_m[term][p.name[1] - 'x'] += p.value * 1e-3;
    }
  } else if (id == "temperature_payload_joint") {
    each_joint(warm_payload);
  } else if (id == "temperature_payload") {
    warm_payload_m_per_K_kg += Xyz(effect) * 1e-3;
  } else if (id == "air_pressure") {
    pressure_m_per_bar += Xyz(effect) * 1e-3;
  } else {
    throw std::runtime_error("no effect " + id);
  }
}

}  // namespace simulator
