#include "app/measure/diagnosis/artefact_start.h"

#include <Eigen/Dense>

#include "firmware-like/geometry/rotation.h"

namespace plumbline::measure {
namespace {

/// The rows of one artefact: predicted TCPs in its frame, and readings [m].
struct ArtefactRows {
  std::vector<Vec3> touched, ranged;
  std::vector<double> readings, ranges;  ///< of gauges; of ranges
};

Vec3 MeanOf(const std::vector<Vec3>& points) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : points) sum += p;
  return points.empty() ? sum : Vec3(sum / static_cast<double>(points.size()));
}

/// Points less their mean, shape (points, 3).
Eigen::MatrixX3d Centred(const std::vector<Vec3>& points) {
  const Vec3 mean = MeanOf(points);
  Eigen::MatrixX3d rows(static_cast<Eigen::Index>(points.size()), 3);
  for (Eigen::Index k = 0; k < rows.rows(); ++k) {
    rows.row(k) = (points[static_cast<std::size_t>(k)] - mean).transpose();
  }
  return rows;
}

/// Solves |p - c|^2 = r_k^2 + constant for the centre and the constant, linear in both.
/// @return  the centre, and the constant less |c|^2 about the mean point
std::pair<Vec3, double> CentreOf(const std::vector<Vec3>& points, const Eigen::VectorXd& squares) {
  const Eigen::MatrixX3d rows = Centred(points);
  Eigen::MatrixXd A(rows.rows(), 4);
  A << 2 * rows, Eigen::VectorXd::Ones(rows.rows());
  const Eigen::VectorXd right = rows.rowwise().squaredNorm() - squares;
  const Eigen::Vector4d x = A.completeOrthogonalDecomposition().solve(right);
  return {MeanOf(points) + x.head<3>(), x[3] + x.head<3>().squaredNorm()};
}

void StartPoint(const ArtefactRows& rows, PlacedArtefact& placed) {
  if (!rows.touched.empty()) {
    placed.place = MeanOf(rows.touched);
    return;
  }
  Eigen::VectorXd squares(static_cast<Eigen::Index>(rows.ranges.size()));
  for (Eigen::Index k = 0; k < squares.size(); ++k) {
    squares[k] = std::pow(rows.ranges[static_cast<std::size_t>(k)], 2);
  }
  placed.place = CentreOf(rows.ranged, squares).first;
}

void StartSphere(const model::Artefact& declared, const ArtefactRows& rows,
                 PlacedArtefact& placed) {
  const auto count = static_cast<Eigen::Index>(rows.touched.size());
  const auto [centre, square] = CentreOf(rows.touched, Eigen::VectorXd::Zero(count));
  if (!declared.place) placed.place = centre;
  if (declared.radius_m) return;
  placed.radius_m = std::sqrt(std::max(square, 0.0));
  if (!declared.place) return;
  double sum = 0;
  for (const Vec3& p : rows.touched) sum += (p - placed.place).norm();
  placed.radius_m = sum / static_cast<double>(std::max<Eigen::Index>(1, count));
}

void StartPlane(const model::Artefact& declared, const ArtefactRows& rows, PlacedArtefact& placed) {
  if (!declared.direction && rows.touched.size() >= 3) {
    const Eigen::MatrixX3d points = Centred(rows.touched);
    const Eigen::SelfAdjointEigenSolver<Mat3> solver(Mat3(points.transpose() * points));
    placed.direction = solver.eigenvectors().col(0);
  }
  if (!declared.place) placed.place = MeanOf(rows.touched);
}

void StartGauge(const model::Artefact& declared, const ArtefactRows& rows, PlacedArtefact& placed) {
  const Eigen::Map<const Eigen::VectorXd> readings(rows.readings.data(),
                                                   static_cast<Eigen::Index>(rows.readings.size()));
  if (!declared.direction && rows.touched.size() >= 4) {
    const Eigen::VectorXd centred = readings.array() - readings.mean();
    const Vec3 slope = Centred(rows.touched).completeOrthogonalDecomposition().solve(centred);
    if (slope.norm() > 0) placed.direction = slope.normalized();
  }
  if (!declared.place) placed.place = MeanOf(rows.touched) - readings.mean() * placed.direction;
}

void StartArtefact(const model::Artefact& declared, const ArtefactRows& rows,
                   PlacedArtefact& placed) {
  switch (declared.kind) {
    case model::ArtefactKind::kPoint:
      if (!declared.place) StartPoint(rows, placed);
      break;
    case model::ArtefactKind::kSphere:
      StartSphere(declared, rows, placed);
      break;
    case model::ArtefactKind::kPlane:
      StartPlane(declared, rows, placed);
      break;
    case model::ArtefactKind::kGauge:
      StartGauge(declared, rows, placed);
      break;
  }
}

/// Sets the orientation of each session's tool from its first measured pose.
void StartOrientations(const Dataset& data, const Linearisation& linear, Model& model) {
  Indexed<SessionIndex, bool> done(data.sessions.size(), false);
  for (const RowIndex row : data.row_indices()) {
    const SessionIndex session = data.session_of[row];
    if (data.observations[row].kind != ObservationKind::kPose || done[session]) continue;
    done[session] = true;
    const LinearRow& at = linear.rows[row];
    const Mat3 R_WT = at.own.bottomRows<3>();
    Mat3& R_FT = model.frames[session].R_FT;
    R_FT = R_FT * (R_WT.transpose() * RotationFromVector(at.residual.tail<3>()) * R_WT);
  }
}

}  // namespace

Result<void> StartPlaces(const Dataset& data, int threads, Model& model) {
  const auto& used = data.used_artefacts;
  const auto& turned = data.turned_sessions;
  const bool any_turned = std::find(turned.begin(), turned.end(), true) != turned.end();
  const bool any_used = std::find(used.begin(), used.end(), true) != used.end();
  if (!any_used && !(any_turned && data.tip_free())) return {};
  const Result<Linearisation> linear = Linearise(data, model, false, threads);
  if (!linear) return Error{linear.error()};
  if (data.tip_free()) StartOrientations(data, *linear, model);
  Indexed<ArtefactIndex, ArtefactRows> rows(used.size());
  for (const RowIndex row : data.row_indices()) {
    const Observation& of = data.observations[row];
    if (!OnArtefact(of.kind)) continue;
    ArtefactRows& own = rows[of.artefact];
    const bool in_base = data.cell.artefacts[of.artefact.offset()].in_base;
    const Pose& X_WB = model.frames[data.session_of[row]].X_WB;
    const Vec3& p_W = linear->rows[row].p_W;
    const Vec3 p = in_base ? X_WB.Inverse() * p_W : p_W;
    if (of.kind == ObservationKind::kArtefactRange) {
      own.ranged.push_back(p);
      own.ranges.push_back(*data.measured(row).range_m);
    } else {
      own.touched.push_back(p);
      own.readings.push_back(*data.measured(row).gauge_m);
    }
  }
  for (const ArtefactIndex artefact : used.indices()) {
    const ArtefactRows& own = rows[artefact];
    if (own.touched.empty() && own.ranged.empty()) continue;  // a subset of the rows may have none
    StartArtefact(data.cell.artefacts[artefact.offset()], own, model.artefacts[artefact]);
  }
  return {};
}

}  // namespace plumbline::measure
