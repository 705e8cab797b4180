#include "app/diagnosis/block_columns.h"

#include <algorithm>

namespace plumbline {

std::shared_ptr<const Eigen::MatrixXd> BlockColumns::Of(const Dataset& data,
                                                        const Linearisation& linear,
                                                        const Block& block, int threads) {
  const std::lock_guard lock(mutex_);
  const auto known = std::find_if(kept_.begin(), kept_.end(),
                                  [&](const Kept& kept) { return SameColumns(kept.block, block); });
  if (known != kept_.end()) return known->columns;
  const auto width = static_cast<int>(block.columns.size());
  auto columns = std::make_shared<Eigen::MatrixXd>(linear.layout.total(), width);
  InParallel(data.rows(), threads, [&](int first, int last) {
    for (const RowIndex row : IndexRange(RowIndex(first), RowIndex(last))) {
      ColumnsAt(data, linear, block, row, linear.layout.PartOf(*columns, row));
    }
  });
  return kept_.emplace_back(Kept{block, std::move(columns)}).columns;
}

}  // namespace plumbline
