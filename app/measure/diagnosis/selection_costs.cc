#include "app/measure/diagnosis/selection_costs.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>

#include "app/measure/diagnosis/candidates.h"
#include "app/measure/diagnosis/row_correlation.h"
#include "app/measure/diagnosis/thresholds.h"
#include "firmware-like/statistics/chi_square.h"

namespace plumbline::measure {

SelectionCosts::SelectionCosts(const LinearProblem& problem)
    : effect_cost_(2 * std::log(EffectsConsidered(problem.data()))) {}

void SelectionCosts::Extend(const CandidateColumns& columns) {
  for (BlockIndex block(inflation_.size()); block.offset() < columns.blocks().size();
       block = BlockIndex(inflation_.size())) {
    double inflation = 1;
    for (const ColumnIndex column : columns.ColumnsIn(block)) {
      inflation = std::max(
          inflation, VarianceInflation(columns.problem(), columns.matrix().col(column.value())));
    }
    inflation_.push_back(inflation);
    unit_costs_.push_back(UnitCosts(columns.problem(), columns.blocks()[block], inflation));
  }
}

std::vector<double> SelectionCosts::UnitCosts(const LinearProblem& problem, const Block& block,
                                              double inflation) const {
  std::vector<int> widths(static_cast<std::size_t>(block.units), 0);
  for (const BlockColumn& column : block.columns) ++widths[column.unit];
  std::vector<double> costs;
  std::map<int, double> quantiles;
  for (const int width : widths) {
    const double evidence = width * std::log(static_cast<double>(problem.clusters()));
    double& quantile = quantiles[width];
    if (quantile == 0 && block.units > 1) {
      quantile = statistics::ChiSquareQuantile(kJointFamilyError / block.units, width);
    }
    costs.push_back(inflation * std::max(evidence, quantile));
  }
  return costs;
}

double SelectionCosts::OfBlock(const Block& block, BlockIndex index) const {
  return inflation_[index] * 2 * std::log(std::max(1.0, block.trials));
}

double SelectionCosts::OfBlocks(const CandidateColumns& columns,
                                const std::set<BlockIndex>& blocks) const {
  double cost = 0;
  for (const BlockIndex block : blocks) cost += OfBlock(columns.blocks()[block], block);
  return cost + effect_cost_ * WeightedEffectCount(columns, blocks);
}

double SelectionCosts::Minimum(const CandidateColumns& candidates,
                               const std::vector<ColumnIndex>& columns) const {
  std::map<BlockIndex, double> cheapest;  // cost of the cheapest unit of each block
  for (const ColumnIndex column : columns) {
    const double cost = OfUnit(candidates.BlockOf(column), candidates.At(column).unit);
    const auto [known, fresh] = cheapest.emplace(candidates.BlockOf(column), cost);
    if (!fresh) known->second = std::min(known->second, cost);
  }
  std::set<BlockIndex> used;
  double cost = 0;
  for (const auto& [block, unit] : cheapest) {
    used.insert(block);
    cost += unit;
  }
  return cost + OfBlocks(candidates, used);
}

double SelectionCosts::WeightedEffectCount(const CandidateColumns& columns,
                                           const std::set<BlockIndex>& blocks) const {
  std::map<std::string_view, double> inflations;  // largest inflation of each id
  double effect_count = 0;
  for (const BlockIndex index : blocks) {
    const Block& block = columns.blocks()[index];
    if (ActsFromEventTime(block.term)) {
      effect_count += inflation_[index];
    } else {
      double& largest = inflations[block.id];
      largest = std::max(largest, inflation_[index]);
    }
  }
  for (const auto& [id, inflation] : inflations) effect_count += inflation;
  return effect_count;
}

}  // namespace plumbline::measure
