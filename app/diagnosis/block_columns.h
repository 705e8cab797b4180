// Cache of block columns at one linearisation, shared by all passes and folds.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "app/diagnosis/blocks.h"

namespace plumbline {

/// Columns over all rows of blocks without a searched shape: every fold, and every pass that moves
/// no frame, needs the same ones. Thread-safe: a mutex is held while a block's columns are
/// computed.
class BlockColumns {
 public:
  /// The columns of a block, shape (residuals of all rows, columns), computed at its first use.
  std::shared_ptr<const Eigen::MatrixXd> Of(const Dataset& data, const Linearisation& linear,
                                            const Block& block, int threads);

 private:
  struct Kept {
    Block block;
    std::shared_ptr<const Eigen::MatrixXd> columns;
  };
  std::mutex mutex_;
  std::vector<Kept> kept_;
};

}  // namespace plumbline
