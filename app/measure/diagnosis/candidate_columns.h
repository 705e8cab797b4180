// Candidate blocks as projected columns of unit length, with their Gram matrix.
#pragma once

#include <vector>

#include "app/measure/diagnosis/blocks.h"
#include "app/measure/diagnosis/linear_problem.h"

namespace plumbline::measure {

/// The columns of all blocks of a candidate set. Free frames are projected out; a column that they
/// absorb, or that cannot be seen at any plausible value, is zero.
class CandidateColumns {
 public:
  explicit CandidateColumns(const LinearProblem& problem) : problem_(problem) {}

  /// Adds the blocks that no listed block has the same columns as.
  /// @return  index of each block, or of the one with the same columns
  std::vector<BlockIndex> Add(const std::vector<Block>& blocks);

  const LinearProblem& problem() const { return problem_; }
  const Indexed<BlockIndex, Block>& blocks() const { return blocks_; }
  IndexRange<ColumnIndex> ColumnsIn(BlockIndex block) const;
  /// The observable columns of these blocks, ascending.
  std::vector<ColumnIndex> ObservableIn(std::vector<BlockIndex> blocks) const;

  BlockIndex BlockOf(ColumnIndex column) const { return block_of_[column]; }
  BlockColumnIndex WithinBlock(ColumnIndex column) const { return local_[column]; }
  const BlockColumn& At(ColumnIndex column) const {
    return blocks_[block_of_[column]].columns[local_[column]];
  }
  /// 0-based; -1 if the column belongs to no joint.
  int JointOf(ColumnIndex column) const;

  /// Projected length before normalising; 0 if not observable.
  double Length(ColumnIndex column) const { return length_[column]; }
  /// 3-D RMS of the raw column per unit of parameter [m].
  double RawRms_m(ColumnIndex column) const { return raw_rms_m_[column]; }
  /// Prior precision of the value of a column scaled to unit length.
  double PriorPrecision(ColumnIndex column) const;
  /// Allowed range of the value of a column scaled to unit length.
  model::Interval Bounds(ColumnIndex column) const;

  const Eigen::MatrixXd& matrix() const { return columns_; }
  double Gram(ColumnIndex a, ColumnIndex b) const { return gram_(a.value(), b.value()); }
  /// Product of a column and the response.
  double Moment(ColumnIndex column) const { return moment_[column.value()]; }

 private:
  /// Lists a block without its columns.
  BlockIndex List(const Block& block);
  /// Computes and scales the columns of the listed blocks from this one on.
  void AddColumns(BlockIndex first);
  /// Scales projected columns to unit length, or to zero if they cannot be seen.
  void Normalise(Eigen::Ref<Eigen::MatrixXd> added, const std::vector<double>& raw_lengths);
  /// Extends the Gram matrix by the last `width` columns.
  void ExtendGram(int width);
  /// Norm of a whitened column over the residuals that are lengths; orientation residuals of poses
  /// are excluded, since they are not in millimetres. The lengths of a row come first, so whitening
  /// by a Cholesky factor does not mix orientations into them.
  double LengthOfLengths(const Eigen::Ref<const Eigen::VectorXd>& column) const;

  const LinearProblem& problem_;
  Indexed<BlockIndex, Block> blocks_;
  Indexed<BlockIndex, ColumnIndex> first_;  ///< column of each block
  Indexed<ColumnIndex, BlockIndex> block_of_;
  Indexed<ColumnIndex, BlockColumnIndex> local_;
  Eigen::MatrixXd columns_;  ///< with room for further ones
  int used_ = 0;
  Eigen::MatrixXd gram_;    ///< columns^T columns
  Eigen::VectorXd moment_;  ///< columns^T response
  Indexed<ColumnIndex, double> length_;
  Indexed<ColumnIndex, double> raw_rms_m_;
};

}  // namespace plumbline::measure
