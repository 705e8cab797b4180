#include "app/measure/diagnosis/candidate_columns.h"

#include <algorithm>
#include <cmath>

#include "app/measure/diagnosis/thresholds.h"

namespace plumbline::measure {
namespace {

constexpr double kMinObservable =
    1e-3;                         // share of a column's length left after projecting out the frames
constexpr double kMinSignal = 1;  // signal over all rows at the largest plausible size, in sigma

}  // namespace

std::vector<BlockIndex> CandidateColumns::Add(const std::vector<Block>& blocks) {
  const BlockIndex first(blocks_.size());
  std::vector<BlockIndex> indices;
  for (const Block& block : blocks) {
    const auto known = std::ranges::find_if(
        blocks_, [&](const Block& other) { return SameColumns(other, block); });
    indices.push_back(known == blocks_.end() ? List(block) : BlockIndex(known - blocks_.begin()));
  }
  if (first.offset() < blocks_.size()) AddColumns(first);
  return indices;
}

BlockIndex CandidateColumns::List(const Block& block) {
  const BlockIndex index(blocks_.size());
  blocks_.push_back(block);
  first_.emplace_back(block_of_.size());
  for (const BlockColumnIndex k : block.columns.indices()) {
    block_of_.push_back(index);
    local_.push_back(k);
  }
  return index;
}

void CandidateColumns::AddColumns(BlockIndex first) {
  const double rows = static_cast<double>(problem_.rows().size());
  const auto width = static_cast<int>(block_of_.size()) - used_;
  if (used_ + width > columns_.cols()) {
    const int room = 2 * (used_ + width) + 64;
    columns_.conservativeResize(problem_.layout().total(), room);
    gram_.conservativeResize(room, room);
    moment_.conservativeResize(room);
  }
  auto added = columns_.middleCols(used_, width);
  std::vector<double> raw_lengths;
  const IndexRange<BlockIndex> blocks(first, BlockIndex(blocks_.size()));
  for (const BlockIndex block : blocks) {
    columns_.middleCols(first_[block].value(), blocks_[block].columns.count()) =
        problem_.Columns(blocks_[block], false);
  }
  for (const auto column : added.colwise()) {
    raw_lengths.push_back(column.norm());
    raw_rms_m_.push_back(LengthOfLengths(column) * problem_.sigma_m() / std::sqrt(rows));
  }
  problem_.Project(added);
  Normalise(added, raw_lengths);
  ExtendGram(width);
}

void CandidateColumns::Normalise(Eigen::Ref<Eigen::MatrixXd> added,
                                 const std::vector<double>& raw_lengths) {
  for (int k = 0; k < static_cast<int>(added.cols()); ++k) {
    auto column = added.col(k);
    const double length = column.norm();
    const bool seen = length > kMinObservable * raw_lengths[k] &&
                      length * At(ColumnIndex(used_ + k)).Largest() > kMinSignal;
    length_.push_back(seen ? length : 0);
    if (seen) {
      column /= length;
    } else {
      column.setZero();
    }
  }
}

void CandidateColumns::ExtendGram(int width) {
  const auto added = columns_.middleCols(used_, width);
  gram_.block(0, used_, used_, width).noalias() = columns_.leftCols(used_).transpose() * added;
  gram_.block(used_, 0, width, used_) = gram_.block(0, used_, used_, width).transpose();
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(width, width);
  own.selfadjointView<Eigen::Lower>().rankUpdate(added.transpose());
  gram_.block(used_, used_, width, width) = own.selfadjointView<Eigen::Lower>();
  moment_.segment(used_, width) = added.transpose() * problem_.response();
  used_ += width;
}

double CandidateColumns::LengthOfLengths(const Eigen::Ref<const Eigen::VectorXd>& column) const {
  const FitLayout& layout = problem_.layout();
  double square = 0;
  for (const FitRowIndex j : problem_.rows().indices()) {
    const auto of_row = layout.PartOf(column, j);
    square += of_row.head(std::min<Eigen::Index>(of_row.size(), kMaxLengths)).squaredNorm();
  }
  return std::sqrt(square);
}

IndexRange<ColumnIndex> CandidateColumns::ColumnsIn(BlockIndex block) const {
  const ColumnIndex first = first_[block];
  return {first, ColumnIndex(first.value() + blocks_[block].columns.count())};
}

std::vector<ColumnIndex> CandidateColumns::ObservableIn(std::vector<BlockIndex> blocks) const {
  std::ranges::sort(blocks);
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  std::vector<ColumnIndex> columns;
  for (const BlockIndex block : blocks) {
    for (const ColumnIndex column : ColumnsIn(block)) {
      if (length_[column] > 0) columns.push_back(column);
    }
  }
  return columns;
}

int CandidateColumns::JointOf(ColumnIndex column) const {
  const Block& block = blocks_[block_of_[column]];
  if (block.empirical()) return -1;
  const auto parameter = static_cast<std::size_t>(At(column).parameter);
  return block.term.parameters[parameter].joint;
}

double CandidateColumns::PriorPrecision(ColumnIndex column) const {
  const double deviation = length_[column] * At(column).Largest();
  return deviation > 0 ? 1 / (deviation * deviation) : 0;
}

model::Interval CandidateColumns::Bounds(ColumnIndex column) const {
  const model::Interval& plausible = At(column).plausible;
  const double scale = kDiscardRatio * length_[column];
  return {scale * plausible.low, scale * plausible.high};
}

}  // namespace plumbline::measure
