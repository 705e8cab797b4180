#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "app/base/config/cell_reader.h"
#include "app/base/config/limits.h"

namespace plumbline::config {
namespace {

constexpr NumberRange kDimension{0.01, 10000, kMetrePerMm};
constexpr NumberRange kLength{1, 20000, kMetrePerMm};
constexpr NumberRange kArea{0.01, 1e8, 1e-6};
constexpr NumberRange kMoment{1e-4, 1e16, 1e-12};
constexpr NumberRange kToolPosition{-20000, 20000, kMetrePerMm};
constexpr NumberRange kYoungsModulus{0.001, 2000, 1e9};
constexpr NumberRange kPoissonRatio{0, 0.5};
constexpr NumberRange kDensity{0, 25000};
constexpr NumberRange kYieldStrength{0.1, 10000, 1e6};
constexpr NumberRange kMountMass{0, 5000};
constexpr double kHeaviest_g_cm3 = 23;  // of all solids

enum class SectionKind { kRectangle, kSquareTube, kTube, kRod, kIBeam };

constexpr std::pair<std::string_view, NumberRange> kOwnRanges[] = {
    {"length_mm", kLength},
    {"area_mm2", kArea},
    {"ix_mm4", kMoment},
    {"iy_mm4", kMoment},
    {"youngs_modulus_GPa", kYoungsModulus},
    {"poisson_ratio", kPoissonRatio},
    {"density_kg_m3", kDensity},
    {"yield_MPa", kYieldStrength},
};

/// Warns about a density that is probably in g/cm3: no solid is heavier than 23 g/cm3, and none is
/// lighter than 23 kg/m3.
void WarnAboutDensity(const TomlTable& table, double density_kg_m3) {
  if (density_kg_m3 <= 0 || density_kg_m3 > kHeaviest_g_cm3) return;
  table.AddWarning("density_kg_m3",
                   fmt::format("looks like g/cm3; write {:g}", 1e3 * density_kg_m3));
}

/// Warns about a value that is so far from that of the named material that one of the two is wrong.
/// Alloys and tempers of one material differ by less than a third.
void WarnAboutContradiction(const TomlTable& table, std::string_view key, double stated,
                            double of_material, double unit) {
  constexpr double kLargestRatio = 1.5;
  if (!table.Has(key) || stated <= 0) return;
  const double ratio = std::max(stated / of_material, of_material / stated);
  if (ratio <= kLargestRatio) return;
  table.AddWarning(key,
                   fmt::format("contradicts material = \"{}\", which has {:g}; remove this key, "
                               "correct it or its unit, or remove the material",
                               table.String("material").value_or(""), of_material / unit));
}

/// E, nu and density of a named material; each value can be overridden by its own key.
std::optional<model::Material> MaterialFromToml(const TomlTable& table) {
  std::optional<model::Material> named;
  if (const auto name = table.String("material")) {
    named = model::MaterialByName(*name);
    if (!named) {
      table.AddFault("material",
                     "is not a known material; give youngs_modulus_GPa, poisson_ratio and "
                     "density_kg_m3 instead");
    }
  }
  // An unknown `material` is already a fault; do not report its values as missing too.
  const bool required = !table.Has("material");
  auto number = [&](std::string_view key, NumberRange range, double model::Material::*field) {
    const auto value = required ? table.RequiredNumber(key, range) : table.Number(key, range);
    if (value) return value;
    if (named && !table.Has(key)) return std::optional<double>((*named).*field);
    return std::optional<double>();
  };
  const auto youngs_modulus_Pa =
      number("youngs_modulus_GPa", kYoungsModulus, &model::Material::youngs_modulus_Pa);
  const auto poisson_ratio =
      number("poisson_ratio", kPoissonRatio, &model::Material::poisson_ratio);
  const auto density_kg_m3 = number("density_kg_m3", kDensity, &model::Material::density_kg_m3);
  const auto yield_strength_Pa = table.Number("yield_MPa", kYieldStrength);
  if (!youngs_modulus_Pa || !poisson_ratio || !density_kg_m3) return std::nullopt;
  WarnAboutDensity(table, *density_kg_m3);
  if (named) {
    WarnAboutContradiction(table, "youngs_modulus_GPa", *youngs_modulus_Pa,
                           named->youngs_modulus_Pa, kYoungsModulus.to_si);
    if (*density_kg_m3 > kHeaviest_g_cm3) {  // else the unit is named above
      WarnAboutContradiction(table, "density_kg_m3", *density_kg_m3, named->density_kg_m3, 1);
    }
  }
  return model::Material{.youngs_modulus_Pa = *youngs_modulus_Pa,
                         .poisson_ratio = *poisson_ratio,
                         .density_kg_m3 = *density_kg_m3,
                         .yield_strength_Pa = yield_strength_Pa};
}

/// Checks that the walls leave a cavity, else adds a fault at `key`; dimensions in metres.
bool WallFits(const TomlTable& table, std::string_view key, double walls_m, double outer_m) {
  if (walls_m < outer_m) return true;
  table.AddFault(key, fmt::format("is too thick: {} mm of wall in {} mm", walls_m / kMetrePerMm,
                                  outer_m / kMetrePerMm));
  return false;
}

std::optional<model::Section> HollowSection(const TomlTable& table, SectionKind kind,
                                            double poisson_ratio) {
  const bool square = kind == SectionKind::kSquareTube;
  const auto outer_m = table.RequiredNumber(square ? "side_mm" : "outer_diameter_mm", kDimension);
  const auto wall_m = table.RequiredNumber("wall_mm", kDimension);
  if (!outer_m || !wall_m || !WallFits(table, "wall_mm", 2 * *wall_m, *outer_m)) return {};
  return square ? model::SquareTubeSection(*outer_m, *wall_m)
                : model::TubeSection(*outer_m, *wall_m, poisson_ratio);
}

std::optional<model::Section> IBeam(const TomlTable& table) {
  const auto height_m = table.RequiredNumber("height_mm", kDimension);
  const auto width_m = table.RequiredNumber("width_mm", kDimension);
  const auto web_m = table.RequiredNumber("web_mm", kDimension);
  const auto flange_m = table.RequiredNumber("flange_mm", kDimension);
  const bool web_fits = !web_m || !width_m || WallFits(table, "web_mm", *web_m, *width_m);
  const bool flanges_fit =
      !flange_m || !height_m || WallFits(table, "flange_mm", 2 * *flange_m, *height_m);
  if (!height_m || !width_m || !web_m || !flange_m || !web_fits || !flanges_fit) return {};
  return model::IBeamSection(*height_m, *width_m, *web_m, *flange_m);
}

std::optional<model::Section> SectionFromToml(const TomlTable& table, double poisson_ratio) {
  if (!table.Has("section") && table.Has("area_mm2")) {
    const auto area_m2 = table.RequiredNumber("area_mm2", kArea);
    const auto ix_m4 = table.RequiredNumber("ix_mm4", kMoment);
    const auto iy_m4 = table.RequiredNumber("iy_mm4", kMoment);
    if (!area_m2 || !ix_m4 || !iy_m4) return {};
    return model::SectionFromMoments(*area_m2, *ix_m4, *iy_m4);
  }
  if (!table.Has("section")) {
    table.AddMissing("section", "the name of a section, or area_mm2, ix_mm4 and iy_mm4");
    return {};
  }
  const auto kind = table.OneOf<SectionKind>("section", {{"rectangle", SectionKind::kRectangle},
                                                         {"square_tube", SectionKind::kSquareTube},
                                                         {"tube", SectionKind::kTube},
                                                         {"rod", SectionKind::kRod},
                                                         {"i_beam", SectionKind::kIBeam}});
  if (!kind) {
    table.Ignore({"b_mm", "h_mm", "side_mm", "outer_diameter_mm", "diameter_mm", "wall_mm",
                  "height_mm", "width_mm", "web_mm", "flange_mm"});
    return {};
  }
  switch (*kind) {
    case SectionKind::kSquareTube:
    case SectionKind::kTube:
      return HollowSection(table, *kind, poisson_ratio);
    case SectionKind::kIBeam:
      return IBeam(table);
    case SectionKind::kRod: {
      const auto diameter_m = table.RequiredNumber("diameter_mm", kDimension);
      if (!diameter_m) return {};
      return model::RodSection(*diameter_m, poisson_ratio);
    }
    case SectionKind::kRectangle: {
      const auto b_m = table.RequiredNumber("b_mm", kDimension);
      const auto h_m = table.RequiredNumber("h_mm", kDimension);
      if (!b_m || !h_m) return {};
      return model::RectangleSection(*b_m, *h_m);
    }
  }
  return {};
}

void AddSegment(const TomlTable& table, model::Tool& tool) {
  const auto length_m = table.RequiredNumber("length_mm", kLength);
  const auto material = MaterialFromToml(table);
  const auto section = SectionFromToml(table, material.value_or(model::Material{}).poisson_ratio);
  if (length_m && material && section) tool.segments.push_back({*length_m, *section, *material});
}

}  // namespace

NumberRange RangeOfToolKey(std::string_view key) {
  for (const auto& [name, range] : kOwnRanges) {
    if (key == name) return range;
  }
  return kDimension;
}

std::vector<model::Tool> ToolsFromToml(const TomlTable& root) {
  std::vector<model::Tool> tools;
  if (!root.Has("tool")) root.AddMissing("tool", "the table [tool]");
  std::map<int, int> line_of;
  const std::vector<TomlTable> tables = root.TableOrTables("tool");
  for (const TomlTable& table : tables) {
    model::Tool tool = ToolFromToml(table);
    tool.number = tables.size() > 1 ? table.RequiredInteger("number", 0, kLargestNumber)
                                    : table.Integer("number", 0, kLargestNumber);
    if (tool.number) {
      const auto [first, is_new] = line_of.emplace(*tool.number, table.LineOf("number"));
      if (!is_new) {
        table.AddFault("number", fmt::format("is already the number of the tool in line {}; give "
                                             "each [[tool]] the number by which the rows name it",
                                             first->second));
      }
    }
    tools.push_back(std::move(tool));
  }
  return tools;
}

model::Tool ToolFromToml(const TomlTable& table) {
  enum class Model { kEulerBernoulli, kTimoshenko, kRigid };
  model::Tool tool;
  const auto model =
      table.RequiredOneOf<Model>("model", {{"euler_bernoulli", Model::kEulerBernoulli},
                                           {"timoshenko", Model::kTimoshenko},
                                           {"rigid", Model::kRigid}});
  table.OneOf<char>("axis", {{"z", 'z'}});
  tool.mount_mass_kg = table.Number("mount_mass_kg", kMountMass).value_or(0);
  tool.rigid = model == Model::kRigid;
  if (tool.rigid) {
    tool.tcp_F = table.RequiredVector3("tcp_mm", kToolPosition).value_or(Vec3::Zero());
    if (tool.mount_mass_kg > 0) {
      table.AddWarning("mount_mass_kg", "acts at the flange, since a rigid tool has no length");
    }
    return tool;
  }
  if (model == Model::kTimoshenko) tool.theory = model::BeamTheory::kTimoshenko;

  if (!table.Has("segment")) {
    AddSegment(table, tool);
  } else {
    for (const TomlTable& segment : table.Tables("segment")) AddSegment(segment, tool);
    for (const char* key : {"length_mm", "section", "area_mm2", "material"}) {
      if (table.Has(key)) {
        table.AddFault(key, "cannot be combined with [[tool.segment]]; give one or the other");
      }
    }
  }
  tool.tcp_F = Vec3(0, 0, tool.Length());
  return tool;
}

}  // namespace plumbline::config
