#include "app/measure/diagnosis/validation/fold_plan.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>

#include "app/measure/diagnosis/linear/nuisances.h"
#include "app/measure/diagnosis/validation/farthest_poses.h"

namespace plumbline::measure {
namespace {

constexpr int kFolds = 5;
constexpr int kBlocksPerFold = 4;
constexpr int kLloydSteps = 20;

/// Joint values of the first row of each cluster, standardised; shape (joints, clusters).
Eigen::MatrixXd ScaledPosesOfClusters(const Dataset& data) {
  const int joints = data.cell.robot.size();
  Eigen::MatrixXd poses = Eigen::MatrixXd::Zero(joints, data.clusters);
  Indexed<ClusterIndex, bool> seen(static_cast<std::size_t>(data.clusters), false);
  for (const RowIndex row : data.row_indices()) {
    const ClusterIndex cluster = data.cluster_of[row];
    if (!seen[cluster]) poses.col(cluster.value()) = data.measured(row).q.head(joints);
    seen[cluster] = true;
  }
  for (int joint = 0; joint < joints; ++joint) {
    auto of_joint = poses.row(joint);
    of_joint.array() -= of_joint.mean();
    const double deviation = std::sqrt(of_joint.squaredNorm() / std::max(1, data.clusters));
    if (deviation > 1e-9) of_joint /= deviation;
  }
  return poses;
}

int NearestCentre(const Eigen::MatrixXd& centres, const Eigen::VectorXd& pose) {
  Eigen::Index nearest = 0;
  (centres.colwise() - pose).colwise().squaredNorm().minCoeff(&nearest);
  return static_cast<int>(nearest);
}

}  // namespace

FoldPlan BlocksOfTime(const Dataset& data) {
  FoldPlan plan;
  plan.by = data.table.recorded.time ? "blocks of time" : "blocks of rows";
  const int count = data.rows();
  const int blocks = std::min(count, kFolds * kBlocksPerFold);
  std::map<ClusterIndex, int> of_cluster;
  for (const RowIndex row : data.row_indices()) {
    const int block = static_cast<int>(std::int64_t{row.value()} * blocks / count);
    const auto [fold, fresh] = of_cluster.emplace(data.cluster_of[row], block % kFolds);
    plan.fold_of.push_back(fold->second);
  }
  plan.folds = std::min(kFolds, count);
  return plan;
}

FoldPlan RegionsOfJointSpace(const Dataset& data) {
  FoldPlan plan;
  plan.by = "regions of the joint space";
  if (data.clusters < 2) return plan;
  const Eigen::MatrixXd poses = ScaledPosesOfClusters(data);
  Eigen::MatrixXd centres = poses(Eigen::all, FarthestColumns(poses, kFolds));
  const int regions = static_cast<int>(centres.cols());
  if (regions < 2) return plan;
  Indexed<ClusterIndex, int> of_cluster(static_cast<std::size_t>(data.clusters), 0);
  for (int step = 0; step < kLloydSteps; ++step) {
    Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(poses.rows(), regions);
    Eigen::VectorXd counts = Eigen::VectorXd::Zero(regions);
    for (const ClusterIndex cluster : of_cluster.indices()) {
      const int region = NearestCentre(centres, poses.col(cluster.value()));
      of_cluster[cluster] = region;
      sums.col(region) += poses.col(cluster.value());
      counts[region] += 1;
    }
    for (int region = 0; region < regions; ++region) {
      if (counts[region] > 0) centres.col(region) = sums.col(region) / counts[region];
    }
  }
  for (const ClusterIndex cluster : data.cluster_of) plan.fold_of.push_back(of_cluster[cluster]);
  plan.folds = regions;
  return plan;
}

FoldPlan OppositeHalves(const Dataset& data) {
  FoldPlan plan;
  plan.by = "opposite halves of the joint space";
  if (data.clusters < 2) return plan;
  Indexed<ClusterIndex, std::optional<model::JointVector>> first(
      static_cast<std::size_t>(data.clusters));
  for (const RowIndex row : data.row_indices()) {
    auto& of_cluster = first[data.cluster_of[row]];
    if (!of_cluster) of_cluster = data.measured(row).q;
  }
  std::vector<model::JointVector> poses;
  for (const auto& pose : first) poses.push_back(pose.value());
  const Eigen::MatrixXd at = DistanceFrom(data.cell, poses).features();
  const auto farthest_from = [&](const Eigen::VectorXd& place) {
    Eigen::Index farthest = 0;
    (at.colwise() - place).colwise().squaredNorm().maxCoeff(&farthest);
    return Eigen::VectorXd(at.col(farthest));
  };
  const Eigen::VectorXd one_end = farthest_from(at.rowwise().mean());
  const Eigen::VectorXd along = at.transpose() * (farthest_from(one_end) - one_end);
  std::vector<double> sorted(along.begin(), along.end());
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  if (*std::ranges::min_element(sorted) == *middle) return plan;
  for (const ClusterIndex cluster : data.cluster_of) {
    plan.fold_of.push_back(along[cluster.value()] < *middle ? 0 : 1);
  }
  plan.folds = 2;
  return plan;
}

FoldPlan Sessions(const Dataset& data) {
  FoldPlan plan;
  plan.by = "sessions";
  if (data.sessions_count() < 2) return plan;
  for (const SessionIndex session : data.session_of) plan.fold_of.push_back(session.value());
  plan.folds = data.sessions_count();
  plan.aligned = true;
  return plan;
}

FoldPlan Places(const Dataset& data) {
  constexpr int kMaxFolds = 10;
  FoldPlan plan;
  plan.by = "places";
  const Nuisances nuisances(data);
  std::map<ComponentIndex, int> number;  // of each place, in the order of its first row
  PerRow<int> place_of;
  for (const RowIndex row : data.row_indices()) {
    const auto group = nuisances.GroupOf(row);
    int& place = place_of.emplace_back(-1);
    if (!group || !nuisances.IsPlace(*group)) continue;
    place = number.emplace(nuisances.ComponentOf(*group), static_cast<int>(number.size()))
                .first->second;
  }
  if (number.size() < 3) return plan;
  plan.folds = std::min(kMaxFolds, static_cast<int>(number.size()));
  plan.places = true;
  for (const int place : place_of) plan.fold_of.push_back(place < 0 ? -1 : place % plan.folds);
  return plan;
}

}  // namespace plumbline::measure
