// Kinds of observation: what a row measures, and how many residuals that gives.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "app/measure/diagnosis/data/indices.h"
#include "app/measure/table/csv.h"
#include "firmware-like/geometry/pose.h"
#include "firmware-like/model/cell_model.h"
#include "firmware-like/result.h"

namespace plumbline::measure {

using ArtefactIndex = TypedIndex<struct ArtefactTag>;  ///< position in the cell's list

/// Quantity that a row measures. It follows from the cells of the row that are filled.
enum class ObservationKind {
  kNone,           ///< joints only
  kPosition,       ///< x, y, z of the TCP in W
  kPose,           ///< position and orientation of the TCP in W
  kRange,          ///< distance from the instrument's anchor to the TCP
  kPoint,          ///< the TCP is at a point artefact
  kSphere,         ///< the TCP is on a sphere
  kPlane,          ///< the TCP is on a plane
  kGauge,          ///< reading of a dial gauge that the TCP touches
  kArtefactRange,  ///< distance from a point artefact to the TCP
};

struct Observation {
  ObservationKind kind = ObservationKind::kPosition;
  ArtefactIndex artefact{};  ///< meaningful if OnArtefact(kind)
};

/// Number of residuals of a row of this kind: 0, 1, 3 or 6.
int ResidualsOf(ObservationKind kind);

/// True if the row refers to an artefact instead of an instrument's frame.
bool OnArtefact(ObservationKind kind);

/// True for the kinds that an instrument reads as a length along a ray.
bool IsRange(ObservationKind kind);

/// The kind as written in files: "position", "range", "point", "sphere", "plane", "gauge". Poses
/// are positions, and both kinds of range are ranges.
const char* Describe(ObservationKind kind);

/// The observation of each row of the table.
/// @return  an error with line, value and remedy if a row names an artefact that the cell lacks, or
///          its measured cells do not belong to that kind of artefact
Result<PerRow<Observation>> ObservationsOf(const model::CellModel& cell,
                                           const MeasuredTable& table);

/// A measured pose has six: three of its position and three of its orientation.
inline constexpr int kMaxResiduals = 6;

/// Maximum number of residuals of a row that are lengths; these come first.
inline constexpr int kMaxLengths = 3;

/// One row's residuals, measured minus predicted: position or range [m] first, then orientation
/// as a rotation vector [rad]. Shape (0..6).
using RowResidual = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxResiduals, 1>;

/// Number and covariance of the residuals of one row.
struct RowNumbers {
  /// Number of residuals: 0 (no measurement), 1 (range), 3 (position) or 6 (pose).
  int count = 0;
  /// Covariance of the residuals divided by the variance of the noise on one axis; [rad^2/m^2] for
  /// orientations. Shape (count, count), positive definite; empty for the identity.
  Eigen::MatrixXd covariance;

  /// Number of residuals that are lengths.
  int lengths() const { return std::min(count, kMaxLengths); }
  /// Sum of the variances of the lengths, divided by that of the noise on one axis.
  double LengthVariance() const {
    return covariance.size() == 0 ? lengths() : covariance.diagonal().head(lengths()).sum();
  }
};

/// Residual of a row as a vector [m]: of its position; (r, 0, 0) for a range; zero without a
/// measurement.
Vec3 LengthsOf(const RowResidual& residual);

/// Mahalanobis length of the residual, sqrt(r^T covariance^-1 r) [m]; divided by sigma, it is in
/// standard deviations.
double SizeOf(const RowNumbers& numbers, const RowResidual& residual);
/// Square of SizeOf [m^2].
double SquareOf(const RowNumbers& numbers, const RowResidual& residual);

/// Position of each row's residuals in a vector stacked in the order of the rows.
template <typename Index>
class ResidualLayout {
 public:
  void Add(int count) { first_.push_back(total() + count); }

  int first(Index row) const { return first_[row.offset()]; }
  int count(Index row) const { return first_[row.offset() + 1] - first(row); }
  int total() const { return first_.back(); }

  /// The part of a stacked vector or matrix, shape (total, ..), that belongs to a row.
  template <typename Stacked>
  auto PartOf(Stacked&& stacked, Index row) const {
    return std::forward<Stacked>(stacked).middleRows(first(row), count(row));
  }

 private:
  std::vector<int> first_ = {0};
};

using RowLayout = ResidualLayout<RowIndex>;
using FitLayout = ResidualLayout<FitRowIndex>;

}  // namespace plumbline::measure
