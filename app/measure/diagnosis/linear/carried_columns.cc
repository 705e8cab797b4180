#include "app/measure/diagnosis/linear/carried_columns.h"

#include <Eigen/Dense>
#include <algorithm>

namespace plumbline::measure {

CarriedColumns::CarriedColumns(const LinearProblem& problem, const std::vector<int>& entries)
    : layout_(problem.layout()),
      carriers_(layout_.total(), static_cast<Eigen::Index>(entries.size())) {
  for (Eigen::Index a = 0; a < carriers_.cols(); ++a) {
    carriers_.col(a) = problem.Carrier(entries[a]);
  }
  const NuisanceProjection& nuisances = problem.nuisances();
  const auto rows = problem.rows().indices();
  std::vector<bool> placed(problem.rows().size(), false);
  for (const NuisanceProjection::Part& part : nuisances.parts()) {
    for (const FitRowIndex row : part.rows) placed[row.offset()] = true;
    rows_.insert(rows_.end(), part.rows.begin(), part.rows.end());
  }
  std::copy_if(rows.begin(), rows.end(), std::back_inserter(rows_),
               [&](FitRowIndex row) { return !placed[row.offset()]; });
  const auto count = static_cast<Eigen::Index>(rows_.size());
  products_.resize(count, NumberOf(0, width()));
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto carrier = layout_.PartOf(carriers_, rows_[k]);
    for (int b = 0; b < width(); ++b) {
      for (int a = 0; a <= b; ++a) {
        products_(k, NumberOf(a, b)) = carrier.col(a).dot(carrier.col(b));
      }
    }
  }
  segment_of_.assign(rows_.size(), -1);
  int first = 0;
  for (const NuisanceProjection::Part& part : nuisances.parts()) {
    std::vector<int> at;
    int residual = 0;
    for (const FitRowIndex row : part.rows) {
      at.push_back(residual);
      residual += layout_.count(row);
    }
    const auto segment = static_cast<int>(segments_.size());
    const auto own = static_cast<int>(part.rows.size());
    std::fill_n(segment_of_.begin() + first, own, segment);
    AddSegment(first, own, part.basis, at);
    first += own;
  }
  std::vector<int> at;
  for (const FitRowIndex row : rows_) at.push_back(layout_.first(row));
  AddSegment(0, static_cast<int>(count), nuisances.frames(), at);
}

void CarriedColumns::AddSegment(int first, int count, const Eigen::MatrixXd& basis,
                                const std::vector<int>& first_residual) {
  Segment& segment = segments_.emplace_back();
  segment.first = first;
  segment.rank = basis.cols();
  segment.along_basis.resize(count, width() * segment.rank);
  for (int k = 0; k < count; ++k) {
    const FitRowIndex row = rows_[static_cast<std::size_t>(first) + static_cast<std::size_t>(k)];
    const auto of_row = basis.middleRows(first_residual[k], layout_.count(row));
    for (int a = 0; a < width(); ++a) {
      segment.along_basis.row(k).segment(a * segment.rank, segment.rank) =
          layout_.PartOf(carriers_, row).col(a).transpose().lazyProduct(of_row);
    }
  }
}

Eigen::MatrixXd CarriedColumns::Gram(const Eigen::Ref<const Eigen::MatrixXd>& factors) const {
  const Eigen::Index count = factors.cols(), wide = width();
  Eigen::MatrixXd gram(count * wide, count * wide);
  Eigen::MatrixXd weighted;
  for (int b = 0; b < wide; ++b) {
    for (int a = 0; a <= b; ++a) {
      weighted = products_.col(NumberOf(a, b)).asDiagonal() * factors;
      const Eigen::MatrixXd of_pair = weighted.transpose() * factors;
      const auto at = [&](Eigen::Index first, Eigen::Index second) {
        return gram(Eigen::seqN(first, count, wide), Eigen::seqN(second, count, wide));
      };
      at(a, b) = of_pair;
      if (a != b) at(b, a) = of_pair;
    }
  }
  Eigen::MatrixXd sums, along;
  for (const Segment& segment : segments_) {
    if (segment.rank == 0) continue;
    const auto own = factors.middleRows(segment.first, segment.along_basis.rows());
    sums.noalias() = own.transpose() * segment.along_basis;
    along.resize(segment.rank, count * wide);
    for (Eigen::Index k = 0; k < count; ++k) {
      for (Eigen::Index a = 0; a < wide; ++a) {
        along.col(k * wide + a) = sums.row(k).segment(a * segment.rank, segment.rank).transpose();
      }
    }
    gram.noalias() -= along.transpose() * along;
  }
  return gram;
}

/// Sums over the rows after a step, updated one row at a time.
class CarriedColumns::StepSums {
 public:
  explicit StepSums(const CarriedColumns& carried)
      : of_(carried),
        gram_(Eigen::MatrixXd::Zero(carried.width(), carried.width())),
        in_places_(gram_) {
    for (const Segment& segment : carried.segments_) {
      along_.emplace_back(Eigen::MatrixXd::Zero(segment.rank, carried.width()));
    }
  }

  void Add(int position) {
    for (int b = 0; b < of_.width(); ++b) {
      for (int a = 0; a <= b; ++a) {
        gram_(a, b) += of_.products_(position, NumberOf(a, b));
        gram_(b, a) = gram_(a, b);
      }
    }
    const int place = of_.segment_of_[position];
    if (place >= 0) {
      Eigen::MatrixXd& along = along_[place];
      in_places_ -= along.transpose().lazyProduct(along);
      AddTo(along, of_.segments_[place], position);
      in_places_ += along.transpose().lazyProduct(along);
    }
    AddTo(along_.back(), of_.segments_.back(), position);
  }

  Eigen::MatrixXd Projected() const {
    return gram_ - in_places_ - along_.back().transpose() * along_.back();
  }

 private:
  static void AddTo(Eigen::MatrixXd& along, const Segment& segment, int position) {
    const auto of_row = segment.along_basis.row(position - segment.first);
    for (Eigen::Index a = 0; a < along.cols(); ++a) {
      along.col(a) += of_row.segment(a * segment.rank, segment.rank).transpose();
    }
  }

  const CarriedColumns& of_;
  Eigen::MatrixXd gram_;
  Eigen::MatrixXd in_places_;  ///< what the bases of the places take from it
  std::vector<Eigen::MatrixXd> along_;
};

std::vector<Eigen::MatrixXd> CarriedColumns::GramsOfSteps(const std::vector<int>& sorted,
                                                          const std::vector<int>& from) const {
  StepSums sums(*this);
  std::vector<Eigen::MatrixXd> grams(from.size());
  auto next = static_cast<int>(sorted.size());
  for (std::size_t step = from.size(); step-- > 0;) {
    while (next > from[step]) sums.Add(sorted[--next]);
    grams[step] = sums.Projected();
  }
  return grams;
}

Eigen::MatrixXd CarriedColumns::Along(const Eigen::VectorXd& residual) const {
  Eigen::MatrixXd along(static_cast<Eigen::Index>(rows_.size()), width());
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    along.row(static_cast<Eigen::Index>(k)) = layout_.PartOf(residual, rows_[k])
                                                  .transpose()
                                                  .lazyProduct(layout_.PartOf(carriers_, rows_[k]));
  }
  return along;
}

Eigen::VectorXd CarriedColumns::Moments(const Eigen::Ref<const Eigen::MatrixXd>& factors,
                                        const Eigen::MatrixXd& along) {
  const Eigen::MatrixXd by_carrier = along.transpose() * factors;  // column k holds those of f_k
  return by_carrier.reshaped();
}

Eigen::MatrixXd InverseForGain(Eigen::MatrixXd gram) {
  constexpr double kDependent = 1e-9, kLeast = 1e-300;
  gram.diagonal().array() += kDependent * gram.diagonal().maxCoeff() + kLeast;
  return gram.ldlt().solve(Eigen::MatrixXd::Identity(gram.rows(), gram.cols()));
}

double GainFrom(const Eigen::MatrixXd& gram, const Eigen::Ref<const Eigen::VectorXd>& moments) {
  return moments.dot(InverseForGain(gram) * moments);
}

}  // namespace plumbline::measure
