// Columns of blocks at one linearisation, kept for every pass and fold that asks for them.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "app/diagnosis/blocks.h"

namespace plumbline {

/// Columns over all rows of blocks whose shapes follow no residual: every fold, and every pass that
/// moves no frame, asks for the same ones. May be used by several threads.
class BlockColumns {
 public:
  /// The columns of a block, shape (3 rows, columns), computed at its first use.
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
