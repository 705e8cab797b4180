#include "app/measure/diagnosis/references.h"

#include <fmt/format.h>

namespace plumbline::measure {
namespace {

const model::Artefact& ArtefactOf(const model::CellModel& cell, int artefact) {
  return cell.artefacts[artefact];
}

const model::KnownDistance& DistanceOf(const model::CellModel& cell, int distance) {
  return cell.distances[distance];
}

}  // namespace

std::vector<Reference> ReferencesOf(const Dataset& data) {
  std::vector<Reference> all;
  const auto& used = data.used_artefacts;
  for (int k = 0; k < static_cast<int>(data.cell.distances.size()); ++k) {
    const model::KnownDistance& distance = DistanceOf(data.cell, k);
    if (used[ArtefactIndex(distance.first)] && used[ArtefactIndex(distance.second)]) {
      all.push_back({k, std::nullopt});
    }
  }
  for (const ArtefactIndex k : used.indices()) {
    const model::Artefact& artefact = ArtefactOf(data.cell, k.value());
    if (used[k] && (artefact.place || artefact.direction || artefact.radius_m)) {
      all.push_back({std::nullopt, k});
    }
  }
  return all;
}

std::string NameOf(const Reference& reference, const model::CellModel& cell) {
  if (reference.artefact) {
    return fmt::format("the declared values of {}",
                       ArtefactOf(cell, reference.artefact->value()).name);
  }
  const model::KnownDistance& distance = DistanceOf(cell, reference.distance.value());
  return fmt::format("the distance between {} and {}", ArtefactOf(cell, distance.first).name,
                     ArtefactOf(cell, distance.second).name);
}

model::CellModel Without(const Reference& reference, model::CellModel cell) {
  if (reference.distance) {
    cell.distances.erase(cell.distances.begin() + *reference.distance);
    return cell;
  }
  model::Artefact& unknown = cell.artefacts[reference.artefact.value().value()];
  unknown.place.reset();
  unknown.direction.reset();
  unknown.radius_m.reset();
  return cell;
}

}  // namespace plumbline::measure
