#include "app/measure/diagnosis/validation/farthest_poses.h"

#include <algorithm>

#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline::measure {

std::vector<Eigen::Index> FarthestColumns(const Eigen::MatrixXd& points, int most) {
  constexpr double kSame = 1e-6;
  std::vector<Eigen::Index> chosen;
  if (points.cols() == 0) return chosen;
  const Eigen::VectorXd mean = points.rowwise().mean();
  Eigen::Index next = 0;
  (points.colwise() - mean).colwise().squaredNorm().minCoeff(&next);
  Eigen::RowVectorXd nearest = Eigen::RowVectorXd::Constant(points.cols(), 1e300);
  while (static_cast<int>(chosen.size()) < most) {
    chosen.push_back(next);
    nearest = nearest.cwiseMin((points.colwise() - points.col(next)).colwise().squaredNorm());
    if (nearest.maxCoeff(&next) < kSame * kSame) break;
  }
  return chosen;
}

std::vector<model::JointVector> StoredPoses(const model::CellModel& cell, const Dataset& data,
                                            const FitRows& rows) {
  std::vector<model::JointVector> measured, stored;
  for (const RowIndex row : rows) measured.push_back(data.measured(row).q);
  for (const Eigen::Index pose :
       FarthestColumns(DistanceFrom(cell, measured).features(), kMaxStoredPoses)) {
    stored.push_back(measured[pose]);
  }
  return stored;
}

double ReachOf(const kinematics::PoseDistance& stored, const Dataset& data, const FitRows& rows) {
  double reach = 0;
  for (const RowIndex row : rows) reach = std::max(reach, stored.Of(data.measured(row).q));
  return reach;
}

kinematics::PoseDistance DistanceFrom(const model::CellModel& cell,
                                      const std::vector<model::JointVector>& poses) {
  return kinematics::PoseDistance(kinematics::Chain(cell.robot), deflection::FarthestTip_F(cell),
                                  poses);
}

}  // namespace plumbline::measure
