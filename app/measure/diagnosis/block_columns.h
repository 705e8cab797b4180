// Cache of block columns at one linearisation, shared by all passes and folds.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "app/measure/diagnosis/blocks.h"

namespace plumbline::measure {

/// Columns over all rows for blocks without a searched shape. Every fold, and every pass that does
/// not change the frames, uses the same ones. Thread-safe; a mutex is locked during the
/// computation.
class BlockColumns {
 public:
  /// The columns of a block, shape (residuals of all rows, columns); computed on first use.
  std::shared_ptr<const Eigen::MatrixXd> Of(const Dataset& data, const Linearisation& linear,
                                            const Block& block, int threads);

 private:
  struct Entry {
    Block block;
    std::shared_ptr<const Eigen::MatrixXd> columns;
  };
  std::mutex mutex_;
  std::vector<Entry> entries_;
};

}  // namespace plumbline::measure
