// References: declared distances, positions, directions and radii that rows on artefacts rely on.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/measure/diagnosis/dataset.h"

namespace plumbline::measure {

/// A [[distance]] between artefacts, or what is declared of one artefact: position, direction and
/// radius. Exactly one of the two is set.
struct Reference {
  std::optional<int> distance;  ///< position in `distances` of the cell
  std::optional<ArtefactIndex> artefact;

  auto operator<=>(const Reference&) const = default;  // NOLINT(modernize-use-nullptr)
};

/// The references between and of artefacts that the rows use.
std::vector<Reference> ReferencesOf(const Dataset& data);

/// "the distance between a and b", "the declared values of a".
std::string NameOf(const Reference& reference, const model::CellModel& cell);

/// The cell with this reference unknown.
model::CellModel Without(const Reference& reference, model::CellModel cell);

}  // namespace plumbline::measure
