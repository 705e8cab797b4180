#include "app/measure/diagnosis/data/dataset.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>

namespace plumbline::measure {

bool Dataset::reads_ranges() const {
  return std::ranges::any_of(
      observations, [](const Observation& observation) { return IsRange(observation.kind); });
}

bool Dataset::instrument_used() const {
  return std::ranges::any_of(
      observations, [](const Observation& observation) { return !OnArtefact(observation.kind); });
}

RowLayout Dataset::layout() const {
  RowLayout layout;
  for (const RowNumbers& of_row : numbers) layout.Add(of_row.count);
  return layout;
}

double Dataset::lengths_per_row() const {
  int measuring = 0, lengths = 0;
  for (const RowNumbers& of_row : numbers) {
    measuring += of_row.count > 0 ? 1 : 0;
    lengths += of_row.lengths();
  }
  return measuring > 0 ? static_cast<double>(lengths) / measuring : 0;
}

double Dataset::noise_per_row() const {
  double measuring = 0, variance = 0;
  for (const RowNumbers& of_row : numbers) {
    measuring += of_row.count > 0 ? 1 : 0;
    variance += of_row.LengthVariance();
  }
  return measuring > 0 ? variance / measuring : 0;
}

FitRows EveryRow(const Dataset& data) {
  return EvenlySpacedRows(data, data.rows());
}

FitRows EvenlySpacedRows(const Dataset& data, int most) {
  FitRows rows;
  const int count = data.rows(), taken = std::min(count, most);
  rows.reserve(taken);
  for (int k = 0; k < taken; ++k) rows.emplace_back(std::int64_t{k} * count / taken);
  return rows;
}

Dataset SelectRows(const Dataset& data, const FitRows& rows) {
  Dataset subset = data;
  // New containers, since cleared ones would keep the memory of all rows.
  subset.table.rows = std::vector<MeasuredRow>();
  subset.conditions = PerRow<effects::Conditions>();
  subset.payloads = PerRow<loads::Payload>();
  subset.observations = PerRow<Observation>();
  subset.numbers = PerRow<RowNumbers>();
  subset.session_of = PerRow<SessionIndex>();
  subset.cluster_of = PerRow<ClusterIndex>();
  for (RecordedSignal& signal : subset.signals) signal.values = PerRow<double>();
  std::map<ClusterIndex, ClusterIndex> renumbered;
  for (const RowIndex row : rows) {
    subset.table.rows.push_back(data.measured(row));
    subset.conditions.push_back(data.conditions[row]);
    subset.payloads.push_back(data.payloads[row]);
    subset.observations.push_back(data.observations[row]);
    subset.numbers.push_back(data.numbers[row]);
    subset.session_of.push_back(data.session_of[row]);
    subset.cluster_of.push_back(
        renumbered.emplace(data.cluster_of[row], ClusterIndex(renumbered.size())).first->second);
    for (const SignalIndex signal : data.signals.indices()) {
      subset.signals[signal].values.push_back(data.signals[signal].values[row]);
    }
  }
  subset.clusters = static_cast<int>(renumbered.size());
  return subset;
}

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
