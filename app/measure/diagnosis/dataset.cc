#include "app/measure/diagnosis/dataset.h"

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

}  // namespace plumbline::measure
