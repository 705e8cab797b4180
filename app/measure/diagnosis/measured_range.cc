#include "app/measure/diagnosis/measured_range.h"

#include <algorithm>
#include <set>

#include "app/measure/diagnosis/joint_combinations.h"
#include "app/measure/diagnosis/thresholds.h"

namespace plumbline::measure {
namespace {

/// The lowest and highest load if all rows are at two distinct loads; otherwise empty. Three loads
/// at least a tenth of their range apart can reveal a deflection that is not proportional to the
/// load.
std::vector<double> FewPayloadLevels(const FitProblem& problem) {
  if (!problem.data.loads_recorded()) return {};
  constexpr double kApart = 0.1;
  std::vector<double> loads_kg, levels_kg;
  for (const RowIndex row : problem.data.row_indices()) {
    if (problem.weights[row] < kOutlierWeight) continue;
    loads_kg.push_back(problem.data.conditions[row].payload_kg);
  }
  std::sort(loads_kg.begin(), loads_kg.end());
  if (loads_kg.empty()) return {};
  const double range_kg = loads_kg.back() - loads_kg.front();
  for (const double load_kg : loads_kg) {
    if (levels_kg.empty() || load_kg - levels_kg.back() >= std::max(kApart * range_kg, 1e-9)) {
      levels_kg.push_back(load_kg);
    }
  }
  return levels_kg.size() == 2 ? std::vector<double>{loads_kg.front(), loads_kg.back()}
                               : std::vector<double>{};
}

}  // namespace

void AddFramesAndDomain(const FitProblem& problem, const Model& model, Diagnosis& diagnosis) {
  const Dataset& data = problem.data;
  if (data.frames_free() || data.tip_free()) {
    for (const SessionIndex session : data.sessions.indices()) {
      model::SessionFrames frames;
      frames.id = data.sessions[session].empty() ? "1" : data.sessions[session];
      frames.X_WB = model.frames[session].X_WB;
      if (data.tip_free()) frames.tip_F = model.frames[session].tip_F;
      diagnosis.sessions.push_back(frames);
    }
  }
  model::Domain& domain = diagnosis.domain;
  const auto widen = [](model::Interval& interval, double value) {
    interval.low = std::min(interval.low, value);
    interval.high = std::max(interval.high, value);
  };
  std::set<int> tools, items;
  for (const RowIndex index : data.row_indices()) {
    if (problem.weights[index] < kOutlierWeight) continue;
    const MeasuredRow& row = data.measured(index);
    const double load_kg = data.conditions[index].payload_kg;
    if (domain.q.empty()) {
      for (const double q : row.q) domain.q.push_back({q, q});
      if (data.loads_recorded()) domain.payload_kg = model::Interval{load_kg, load_kg};
      if (row.temp_C) domain.temp_C = model::Interval{*row.temp_C, *row.temp_C};
    }
    for (std::size_t i = 0; i < domain.q.size(); ++i)
      widen(domain.q[i], row.q[static_cast<int>(i)]);
    if (domain.payload_kg) widen(*domain.payload_kg, load_kg);
    if (data.cell.tool.number) tools.insert(*data.cell.ToolAt(data.payloads[index].tool).number);
    items.insert(data.payloads[index].item);
    if (domain.temp_C) widen(*domain.temp_C, *row.temp_C);
  }
  domain.tools.assign(tools.begin(), tools.end());
  if (!data.cell.payload_items.empty()) domain.payload_items.emplace(items.begin(), items.end());
  domain.combinations = NearlyConstantCombinations(problem);
  domain.payload_levels_kg = FewPayloadLevels(problem);
}

}  // namespace plumbline::measure
