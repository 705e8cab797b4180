#include "app/diagnosis/fit_problem.h"

namespace plumbline {

FitProblem FitOfEveryRow(const Dataset& data, int threads) {
  return {data, EveryRow(data), PerRow<double>(data.table.rows.size(), 1.0), data.sigma_m, threads};
}

}  // namespace plumbline
