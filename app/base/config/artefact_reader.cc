#include <fmt/format.h>

#include <algorithm>

#include "app/base/config/cell_reader.h"
#include "app/base/config/limits.h"
#include "app/base/text/text.h"

namespace plumbline::config {
namespace {

constexpr NumberRange kLength{1e-3, 100000, kMetrePerMm};
constexpr NumberRange kDeviation{0, 10000, kMetrePerMm};
constexpr NumberRange kComponent{-1e6, 1e6};
constexpr double kMinDirection = 1e-9;

/// A unit vector; a fault if the vector has no direction.
std::optional<Vec3> DirectionFrom(const TomlTable& table, std::string_view key) {
  const auto vector = table.Vector3(key, kComponent);
  if (!vector) return std::nullopt;
  if (vector->norm() < kMinDirection) {
    table.AddFault(key, "has no direction: its length is zero");
    return std::nullopt;
  }
  return vector->normalized();
}

/// Adds a fault for a key that the kind of artefact does not have.
void RefuseKey(const TomlTable& table, std::string_view key, std::string_view only) {
  if (table.Has(key)) {
    table.AddFault(key, fmt::format("is allowed with kind = {} only: remove it", only));
  }
  table.Ignore({key});
}

model::Artefact ArtefactFromToml(const TomlTable& table) {
  using Kind = model::ArtefactKind;
  model::Artefact artefact;
  artefact.name = table.RequiredString("name").value_or("");
  if (artefact.name.find_first_of(",\"\n\r") != std::string::npos) {
    table.AddFault("name", "must not contain a comma, a quote or a line break");
  } else if (table.Has("name") && artefact.name.empty()) {
    table.AddFault("name", "must not be empty");
  }
  const auto kind = table.RequiredOneOf<Kind>("kind", {{"point", Kind::kPoint},
                                                       {"sphere", Kind::kSphere},
                                                       {"plane", Kind::kPlane},
                                                       {"gauge", Kind::kGauge}});
  artefact.kind = kind.value_or(Kind::kPoint);
  artefact.place = table.Vector3("xyz_mm", kPlaceRange);
  artefact.in_base =
      table.OneOf<bool>("frame", {{"measurement", false}, {"base", true}}).value_or(false);
  artefact.sd_m = table.Number("sd_mm", kDeviation).value_or(0);
  if (!kind) {
    table.Ignore({"normal", "direction", "radius_mm"});
    return artefact;
  }
  if (kind == Kind::kPlane) {
    artefact.direction = DirectionFrom(table, "normal");
  } else {
    RefuseKey(table, "normal", "\"plane\"");
  }
  if (kind == Kind::kGauge) {
    artefact.direction = DirectionFrom(table, "direction");
  } else {
    RefuseKey(table, "direction", "\"gauge\"");
  }
  if (kind == Kind::kSphere) {
    artefact.radius_m = table.Number("radius_mm", kLength);
  } else {
    RefuseKey(table, "radius_mm", "\"sphere\"");
  }
  if (table.Has("sd_mm") && !artefact.place && !artefact.radius_m) {
    table.AddFault("sd_mm", "requires xyz_mm or radius_mm: without them the place is unknown");
  }
  return artefact;
}

/// Position of a named point artefact in the list.
std::optional<int> PointNamed(const TomlTable& table, const std::string& name,
                              const std::vector<model::Artefact>& artefacts) {
  const auto found =
      std::find_if(artefacts.begin(), artefacts.end(),
                   [&](const model::Artefact& artefact) { return artefact.name == name; });
  if (found == artefacts.end()) {
    std::vector<std::string> names;
    names.reserve(artefacts.size());
    for (const model::Artefact& artefact : artefacts) names.push_back(artefact.name);
    const std::string nearest = text::NearestWord(name, names, 0.4);
    table.AddFault("between",
                   fmt::format("names \"{}\", which is no [[artefact]]{}", name,
                               nearest.empty() ? "" : fmt::format("; did you mean {}?", nearest)));
    return std::nullopt;
  }
  if (found->kind != model::ArtefactKind::kPoint) {
    table.AddFault("between", fmt::format("names \"{}\", which is not of kind \"point\"", name));
    return std::nullopt;
  }
  return static_cast<int>(found - artefacts.begin());
}

}  // namespace

std::vector<model::Artefact> ArtefactsFromToml(const TomlTable& root) {
  std::vector<model::Artefact> artefacts;
  for (const TomlTable& table : root.Tables("artefact")) {
    model::Artefact artefact = ArtefactFromToml(table);
    const bool known =
        std::any_of(artefacts.begin(), artefacts.end(),
                    [&](const model::Artefact& other) { return other.name == artefact.name; });
    if (known && !artefact.name.empty()) table.AddFault("name", "is used for two artefacts");
    artefacts.push_back(std::move(artefact));
  }
  return artefacts;
}

std::vector<model::KnownDistance> DistancesFromToml(const TomlTable& root,
                                                    const std::vector<model::Artefact>& artefacts) {
  std::vector<model::KnownDistance> distances;
  for (const TomlTable& table : root.Tables("distance")) {
    model::KnownDistance distance;
    distance.value_m = table.RequiredNumber("value_mm", kLength).value_or(1);
    distance.sd_m = table.Number("sd_mm", kDeviation).value_or(0);
    if (!table.Has("between")) table.AddMissing("between", "the names of two [[artefact]]");
    const auto names = table.Strings("between");
    if (!names) continue;
    if (names->size() != 2) {
      table.AddFault("between", "is not a list of the names of two [[artefact]]");
      continue;
    }
    const auto first = PointNamed(table, (*names)[0], artefacts);
    const auto second = PointNamed(table, (*names)[1], artefacts);
    if (!first || !second) continue;
    if (*first == *second) table.AddFault("between", "names the same artefact twice");
    const auto in_base = [&](int k) { return artefacts[static_cast<std::size_t>(k)].in_base; };
    if (in_base(*first) != in_base(*second)) {
      table.AddFault("between", "names artefacts of different frames: declare both in one");
    }
    distance.first = *first;
    distance.second = *second;
    distances.push_back(distance);
  }
  return distances;
}

}  // namespace plumbline::config
