// Effects of the tool and the payload.
#pragma once

#include <algorithm>

#include "firmware-like/effects/contributions.h"

namespace plumbline::effects {

/// The ratio for a relative change of the bending: 1/(1 + ratio) = 1 - linear, limited to a
/// twentieth of the stiffness.
double RatioFromBending(double linear) {
  constexpr double kSoftest = 0.05;
  return 1 / std::max(kSoftest, 1 - linear) - 1;
}

/// Tool stiffness: a tool that bends less or more than its section predicts.
/// E I of the tool is multiplied by 1 + ratio; the bending of the declared beam is
/// divided by it. Unit: 1; must be above -1. A joined or perforated tool may well have half its
/// nominal stiffness.
struct ToolStiffness {
  static EffectTraits Traits() {
    return {.id = "tool_stiffness",
            .meaning = "the tool's bending stiffness differs from the declared one",
            .remedy =
                "check section, wall and modulus of the tool in cell.toml; a sudden drop indicates "
                "a crack",
            .formula = "E I of the tool is multiplied by (1 + ratio)",
            .shown_by =
                "different payloads and different orientations of the tool; a tool that hangs "
                "vertically hardly bends",
            .sound_size =
                "0 for a solid section; a joined or perforated tool may have half its nominal "
                "stiffness",
            .parameters = {{.name = "ratio",
                            .unit = "1",
                            .plausible = {-0.6, 1.5},
                            .value_of_linear = RatioFromBending}},
            .needs = {Signal::kBeam},
            .confused_with = {"payload_mass", "payload_cog", "tool_root_compliance", "tool_shear",
                              "tool_frame"}};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions&,
                  Influence<T>& influence) {
    // A tool with E I (1 + ratio) bends by a factor of 1/(1 + ratio).
    for (const T& ratio : values) {
      influence[Influence<T>::kBendRatio] += 1.0 / (1.0 + ratio) - 1.0;
    }
  }
};

/// Tool shear: a short tool that deforms by shear as well as by bending.
/// The tip moves by F L / (kappa G A) across the tool, with F the transverse force of the payload
/// [Gere & Timoshenko, Mechanics of Materials; kappa: Cowper 1966, J. Appl. Mech. 33(2)]. Unit: 1.
/// Add() receives the linear quantity 1/kappa, which is 0 if shear is neglected. kappa is 0.85 for
/// a solid rectangle, 0.44 for a thin square tube. Relevant below L/h of about 10. A tool declared
/// with Timoshenko theory already includes its shear; this effect adds to it.
struct ToolShear : AddsFrom<Entries::kShear> {
  static EffectTraits Traits() {
    return {
        .id = "tool_shear",
        .meaning = "the tool shears under the payload, in addition to bending",
        .remedy = "declare the tool with model = \"timoshenko\"",
        .formula = "tip += F L / (kappa G A), across the tool",
        .shown_by =
            "a force without a moment at the tip: payloads with their centre of gravity at "
            "different distances",
        .sound_size =
            "0.85 for a solid rectangle, 0.44 for a thin square tube [Cowper 1966]; "
            "relevant below L/h of about 10",
        .parameters = {{.name = "kappa", .unit = "1", .plausible = {0.2, 1.2}, .inverse = true}},
        .needs = {Signal::kBeam, Signal::kPayload},
        .confused_with = {"tool_stiffness", "payload_mass", "tool_root_compliance"}};
  }
};

/// Tool root compliance: a flange coupling that tilts under the tool's moment.
/// The coupling rotates by value times the transverse moment about the root: that of the payload at
/// its centre of gravity plus that of the tool body at mid length (without the mount). The tip
/// moves by that rotation x (0, 0, L). Unit: rad/(N m). Valid as long as the faces of
/// the coupling stay in contact.
struct ToolRootCompliance : AddsFrom<Entries::kRootCompliance> {
  static EffectTraits Traits() {
    return {
        .id = "tool_root_compliance",
        .meaning = "the tool's seat on the flange tilts under load",
        .remedy =
            "check the flange screws and the tool changer's wear; otherwise let the correction "
            "compensate for it",
        .formula = "tip += v M_root x (0, 0, L)",
        .shown_by =
            "payloads with their centre of gravity at different distances from the flange, "
            "and different orientations of the tool",
        .sound_size = "tool changer: about 0.5 mrad at its rated moment (engineering judgement)",
        .parameters = {{"compliance", "rad/(N m)", 1, {0, 1e-4}}},
        .needs = {},
        .confused_with = {"tool_stiffness", "payload_cog", "payload_mass", "tool_shear",
                          "joint_compliance"}};
  }
};

/// Payload mass: the payload weighs more or less than its recorded mass.
/// m becomes m (1 + scale) + constant, in every row including those without payload.
/// Units: 1, kg. The scale represents a wrong unit or load cell, the constant a gripper or hose
/// that was not entered. The mass acts at the declared centre of gravity, on the joints and on the
/// tool.
struct PayloadMass {
  enum Parameter { kScale, kConstant };

  static EffectTraits Traits() {
    return {
        .id = "payload_mass",
        .meaning = "the payload weighs more or less than the program says",
        .remedy = "weigh the load, and look for a gripper, a hose or a cable that was not entered",
        .formula = "m becomes m (1 + scale) + constant, in every row",
        .shown_by = "rows without payload beside rows with several payloads",
        .sound_size =
            "5 % and 0.1 kg (engineering judgement); gross errors occur, such as 0.36 kg "
            "entered for a gripper of 0.925 kg [ros_kortex, issue 212]",
        .parameters = {{"scale", "1", 1, {-0.3, 0.3}}, {"constant", "kg", 1, {-20, 20}}},
        .needs = {Signal::kPayload},
        .confused_with = {"tool_stiffness", "joint_compliance", "payload_cog",
                          "tool_root_compliance", "gravity_direction"},
        .independent_parameters = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      const double per_unit = term.parameters[k].spec == kScale ? conditions.payload_kg : 1.0;
      influence[Influence<T>::kPayloadMass] += values[k] * per_unit;
    }
  }
};

/// Payload centre of gravity: a load whose centre of gravity is not where it was declared.
/// The payload's centre of gravity moves by (x, y, z) in F. File unit: mm. Has no
/// effect without a payload.
struct PayloadCog : AddsFrom<Entries::kPayloadCog> {
  static EffectTraits Traits() {
    return {
        .id = "payload_cog",
        .meaning = "the payload's centre of gravity is elsewhere than declared",
        .remedy = "check cog_mm of the payload in cell.toml, and how the part sits in the gripper",
        .formula = "the centre of gravity moves by (x, y, z) in F",
        .shown_by = "different orientations of the tool, with and without payload",
        .sound_size = "20 mm and 10 % of the distance from the flange (engineering judgement)",
        .parameters = {{"x", "mm", 1e-3, {-150, 150}},
                       {"y", "mm", 1e-3, {-150, 150}},
                       {"z", "mm", 1e-3, {-150, 150}}},
        .needs = {Signal::kPayload},
        .confused_with = {"payload_mass", "tool_root_compliance", "tool_stiffness", "tool_frame",
                          "joint_compliance"}};
  }
};

}  // namespace plumbline::effects
