#include "app/measure/diagnosis/artefact_mistakes.h"

#include <fmt/format.h>

#include <utility>

namespace plumbline::measure {
namespace {

constexpr std::size_t kMaxSwapped = 12;

void ReverseGauge(ArtefactIndex gauge, Dataset& data) {
  for (const RowIndex row : data.row_indices()) {
    const Observation& of = data.observations[row];
    std::optional<double>& gauge_m = data.table.rows[row.offset()].gauge_m;
    if (of.kind == ObservationKind::kGauge && of.artefact == gauge && gauge_m) *gauge_m *= -1;
  }
}

void AddReversedGauge(ArtefactIndex index, const std::string& name,
                      std::vector<Mistake>& mistakes) {
  Mistake& mistake = mistakes.emplace_back();
  mistake.sentence = fmt::format("the gauge {} reads with the opposite sign", name);
  mistake.remedy = "reverse its direction in the cell, or the sign of gauge_mm";
  mistake.undo = [index](Dataset& data) { ReverseGauge(index, data); };
  mistake.subtle = true;
  mistake.affects = [name](const MeasuredRow& row) { return row.artefact == name; };
}

void AddSwapped(const model::CellModel& cell, ArtefactIndex one, ArtefactIndex other,
                std::vector<Mistake>& mistakes) {
  const model::Artefact& a = cell.artefacts[one.offset()];
  const model::Artefact& b = cell.artefacts[other.offset()];
  if (a.kind != b.kind) return;
  Mistake& mistake = mistakes.emplace_back();
  mistake.sentence = fmt::format("{} and {} are swapped", a.name, b.name);
  mistake.remedy = "check their places in the cell against their names in the rows";
  mistake.undo = [one, other](Dataset& data) {
    std::swap(data.cell.artefacts[one.offset()], data.cell.artefacts[other.offset()]);
  };
}

}  // namespace

void AddArtefactMistakes(const Dataset& data, std::vector<Mistake>& mistakes) {
  std::vector<ArtefactIndex> placed;
  for (const ArtefactIndex index : data.used_artefacts.indices()) {
    if (!data.used_artefacts[index]) continue;
    const model::Artefact& artefact = data.cell.artefacts[index.offset()];
    if (artefact.kind == model::ArtefactKind::kGauge) {
      AddReversedGauge(index, artefact.name, mistakes);
    }
    if (artefact.place) placed.push_back(index);
  }
  if (placed.size() > kMaxSwapped) return;
  for (std::size_t k = 0; k < placed.size(); ++k) {
    for (std::size_t l = k + 1; l < placed.size(); ++l) {
      AddSwapped(data.cell, placed[k], placed[l], mistakes);
    }
  }
}

}  // namespace plumbline::measure
