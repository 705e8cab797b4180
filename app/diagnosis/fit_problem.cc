#include "app/diagnosis/fit_problem.h"

namespace plumbline {

FitLayout FitProblem::layout() const {
  FitLayout layout;
  for (const RowIndex row : rows) layout.Add(data.numbers[row].count);
  return layout;
}

FitProblem FitOfEveryRow(const Dataset& data, int threads) {
  return {data, EveryRow(data), PerRow<double>(data.table.rows.size(), 1.0), data.sigma_m, threads};
}

}  // namespace plumbline
