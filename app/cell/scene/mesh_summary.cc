#include "app/cell/scene/mesh_summary.h"

#include <fmt/format.h>

#include "app/base/text/json_text.h"

namespace plumbline::cell {
namespace {

/// Sizes outside this range suggest a wrong unit [m].
constexpr double kUnlikelyLarge_m = 100, kUnlikelySmall_m = 1e-3;

const char* FacingWord(scene::Facing facing) {
  switch (facing) {
    case scene::Facing::kOutwards:
      return "outwards";
    case scene::Facing::kInwards:
      return "inwards";
    case scene::Facing::kMixed:
      return "mixed";
    case scene::Facing::kNotClosed:
      break;
  }
  return "unknown";
}

/// Factor for displayed lengths: to mm, or 1 for the file's own unit.
double ShownScale(const std::optional<std::string>& unit) {
  return unit ? 1e3 : 1;
}

std::string VectorText(const Vec3& v, const char* between) {
  return fmt::format("{1:.6g}{0}{2:.6g}{0}{3:.6g}", between, v.x(), v.y(), v.z());
}

}  // namespace

std::vector<std::string> MeshWarnings(const MeshFile& file,
                                      const std::optional<std::string>& unit) {
  const scene::MeshFacts& facts = file.checked.facts;
  const double largest_m = (facts.max_O - facts.min_O).maxCoeff();
  std::vector<std::string> warnings;
  if (!unit) {
    warnings.push_back(
        fmt::format("no unit stated: the largest side is {:.4g} mm if in mm, {:.4g} mm if in m, "
                    "{:.4g} mm if in "
                    "inches; give --unit, and unit in objects.toml",
                    largest_m, 1e3 * largest_m, 25.4 * largest_m));
  } else if (largest_m > kUnlikelyLarge_m || largest_m < kUnlikelySmall_m) {
    warnings.push_back(fmt::format("the largest side is {:.4g} mm: is {} the right unit?",
                                   1e3 * largest_m, *unit));
  }
  std::string coarse = PrecisionProblem(file, ShownScale(unit), unit ? "mm" : "file units");
  if (!coarse.empty()) warnings.push_back(std::move(coarse));
  if (facts.degenerate > 0) {
    warnings.push_back(
        fmt::format("{} degenerate triangles were omitted, which is harmless", facts.degenerate));
  }
  if (!facts.closed()) {
    warnings.push_back(fmt::format(
        "the surface is open, with {} boundary edges: objects entirely inside it are not detected "
        "as interference; close it if it is a solid body",
        facts.open_edges));
  }
  if (facts.facing() == scene::Facing::kInwards) {
    warnings.emplace_back(
        "the triangles face inwards: flip the normals, otherwise it is shaded as a hole");
  }
  if (facts.opposed_edges > 0) {
    warnings.push_back(fmt::format(
        "at {} edges the triangles are oriented inconsistently: make the normals consistent, "
        "otherwise parts of it are shaded wrongly",
        facts.opposed_edges));
  }
  if (file.other_elements > 0) {
    warnings.push_back(
        fmt::format("{} points or lines were omitted: they have no surface", file.other_elements));
  }
  if (file.outside_count > 0) {
    std::string names;
    for (const std::string& name : file.outside) names += (names.empty() ? "" : ", ") + name;
    warnings.push_back(fmt::format(
        "it refers to {} other file{} or address{}, which are never opened: {}; the shape is "
        "complete without them, and the colour is set in objects.toml",
        file.outside_count, file.outside_count == 1 ? "" : "s", file.outside_count == 1 ? "" : "es",
        names));
  }
  return warnings;
}

std::string MeshText(const MeshFile& file, const std::string& name,
                     const std::optional<std::string>& unit) {
  const scene::MeshFacts& facts = file.checked.facts;
  const double scale = ShownScale(unit);
  const char* const shown = unit ? "mm" : "in file units";
  std::string text = fmt::format("{:12} {}, {}, {} bytes{}\n", "file", name, WordOf(file.format),
                                 file.bytes, unit ? ", in " + *unit : std::string());
  text +=
      fmt::format("{:12} {}\n{:12} {}\n", "triangles", facts.triangles, "vertices", facts.vertices);
  text += fmt::format("{:12} {} {}, from ({}) to ({})\n", "size",
                      VectorText(scale * (facts.max_O - facts.min_O), " x "), shown,
                      VectorText(scale * facts.min_O, ", "), VectorText(scale * facts.max_O, ", "));
  text += fmt::format("{:12} {}, {} part{}\n", "surface", facts.closed() ? "closed" : "open",
                      facts.parts, facts.parts == 1 ? "" : "s");
  if (facts.closed()) {
    text += fmt::format("{:12} {}\n", "facing", FacingWord(facts.facing()));
    text += fmt::format("{:12} {:.6g} {}^3\n", "volume", scale * scale * scale * facts.volume_m3,
                        shown);
  }
  for (const std::string& warning : MeshWarnings(file, unit)) text += "warning: " + warning + '\n';
  return text;
}

std::string MeshJson(const MeshFile& file, const std::string& name,
                     const std::optional<std::string>& unit) {
  const scene::MeshFacts& facts = file.checked.facts;
  const double scale = ShownScale(unit);
  const auto list = [scale](const Vec3& v) {
    return nlohmann::json{scale * v.x(), scale * v.y(), scale * v.z()};
  };
  nlohmann::json json = {{"schema", 1},
                         {"file", name},
                         {"format", WordOf(file.format)},
                         {"bytes", file.bytes},
                         {"unit", nullptr},
                         {"triangles", facts.triangles},
                         {"vertices", facts.vertices},
                         {"degenerate", facts.degenerate},
                         {"closed", facts.closed()},
                         {"open_edges", facts.open_edges},
                         {"opposed_edges", facts.opposed_edges},
                         {"parts", facts.parts},
                         {"facing", FacingWord(facts.facing())},
                         {"other_elements", file.other_elements},
                         {"outside", file.outside},
                         {"warnings", MeshWarnings(file, unit)}};
  if (unit) json["unit"] = *unit;
  const std::string suffix = unit ? "_mm" : "_file_unit";
  json["size" + suffix] = list(facts.max_O - facts.min_O);
  json["min" + suffix] = list(facts.min_O);
  json["max" + suffix] = list(facts.max_O);
  if (facts.closed()) json["volume" + suffix + "3"] = scale * scale * scale * facts.volume_m3;
  return text::JsonText(json, 2) + '\n';
}

}  // namespace plumbline::cell
