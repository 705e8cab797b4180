#include "app/measure/diagnosis/fit_problem.h"

#include "app/measure/diagnosis/nuisances.h"

namespace plumbline::measure {

FitLayout FitProblem::layout() const {
  FitLayout layout;
  for (const RowIndex row : rows) layout.Add(data.numbers[row].count);
  layout.Add(Nuisances(data).equations());
  return layout;
}

FitProblem UnitWeightFit(const Dataset& data, int threads) {
  PerRow<double> weights;
  for (const RowNumbers& of_row : data.numbers) weights.push_back(of_row.count > 0 ? 1 : 0);
  return {data, EveryRow(data), std::move(weights), data.sigma_m, threads};
}

}  // namespace plumbline::measure
