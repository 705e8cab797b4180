#include "app/measure/diagnosis/block_columns.h"

#include <algorithm>

namespace plumbline::measure {

std::shared_ptr<const Eigen::MatrixXd> BlockColumns::Of(const Dataset& data,
                                                        const Linearisation& linear,
                                                        const Block& block, int threads) {
  const std::lock_guard lock(mutex_);
  const auto known = std::ranges::find_if(
      entries_, [&](const Entry& entry) { return SameColumns(entry.block, block); });
  if (known != entries_.end()) return known->columns;
  const auto width = static_cast<int>(block.columns.size());
  auto columns = std::make_shared<Eigen::MatrixXd>(linear.layout.total(), width);
  InParallel(data.rows(), threads, [&](int first, int last) {
    for (const RowIndex row : IndexRange(RowIndex(first), RowIndex(last))) {
      ColumnsAt(data, linear, block, row, linear.layout.PartOf(*columns, row));
    }
  });
  return entries_.emplace_back(Entry{block, std::move(columns)}).columns;
}

}  // namespace plumbline::measure
