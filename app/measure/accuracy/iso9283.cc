#include "app/measure/accuracy/iso9283.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace plumbline::measure {
namespace {

constexpr int kCyclesForRepeatability = 3;  // two always have equal distances from their mean
constexpr std::size_t kMaxDistancePoses = 1000;

/// Readings of a pose without one of another pose between them, as positions in the list.
using Visit = std::vector<std::size_t>;

struct PoseReadings {
  std::vector<Visit> visits;
  std::vector<std::size_t> All() const {
    std::vector<std::size_t> all;
    for (const Visit& visit : visits) all.insert(all.end(), visit.begin(), visit.end());
    return all;
  }
};

/// The readings by pose, in the order of each pose's first reading.
std::vector<PoseReadings> ByPose(const std::vector<Reading>& readings) {
  std::vector<PoseReadings> poses;
  std::map<int, std::size_t> place;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto [found, added] = place.emplace(readings[k].pose, poses.size());
    if (added) poses.emplace_back();
    PoseReadings& pose = poses[found->second];
    if (k == 0 || readings[k - 1].pose != readings[k].pose) pose.visits.emplace_back();
    pose.visits.back().push_back(k);
  }
  return poses;
}

Vec3 MeanError(const std::vector<Reading>& readings, const std::vector<std::size_t>& visits) {
  Vec3 sum = Vec3::Zero();
  for (const std::size_t k : visits) sum += readings[k].error_W;
  return sum / static_cast<double>(visits.size());
}

PoseCharacteristics PoseOf(const std::vector<Reading>& readings, const PoseReadings& pose) {
  const std::vector<std::size_t> all = pose.All();
  const auto n = static_cast<double>(all.size());
  PoseCharacteristics characteristics;
  characteristics.pose = readings[all.front()].pose;
  characteristics.session = readings[all.front()].session;
  characteristics.cycles = static_cast<int>(all.size());
  characteristics.mean_error_W = MeanError(readings, all);
  characteristics.accuracy_m = characteristics.mean_error_W.norm();
  for (const std::size_t k : all) characteristics.barycentre_W += readings[k].attained_W / n;
  if (characteristics.cycles < kCyclesForRepeatability) return characteristics;
  double mean = 0, square = 0;
  for (const std::size_t k : all)
    mean += (readings[k].error_W - characteristics.mean_error_W).norm() / n;
  for (const std::size_t k : all) {
    const double distance = (readings[k].error_W - characteristics.mean_error_W).norm();
    square += (distance - mean) * (distance - mean);
  }
  const double sigma = std::sqrt(square / (n - 1));
  characteristics.repeatability_m = mean + 3 * sigma;
  characteristics.repeatability_u_m = sigma * std::sqrt(1 / n + 9 / (2 * (n - 1)));
  return characteristics;
}

/// Adds the scatter of the cycles, pooled over the poses.
void AddCycleScatter(const std::vector<Reading>& readings, const std::vector<PoseReadings>& poses,
                     Characteristics& all) {
  double square = 0;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    for (const std::size_t at : poses[k].All()) {
      square += (readings[at].error_W - all.poses[k].mean_error_W).squaredNorm();
    }
    all.cycle_degrees_of_freedom += 3 * (all.poses[k].cycles - 1);
  }
  if (all.cycle_degrees_of_freedom > 0)
    all.cycle_sigma_m = std::sqrt(square / all.cycle_degrees_of_freedom);
}

void AddDistances(Characteristics& all) {
  const std::size_t stride = 1 + (all.poses.size() - 1) / kMaxDistancePoses;
  for (std::size_t i = 0; i < all.poses.size(); i += stride) {
    const PoseCharacteristics& first = all.poses[i];
    for (std::size_t j = i + stride; j < all.poses.size(); j += stride) {
      const PoseCharacteristics& second = all.poses[j];
      if (first.session != second.session) continue;
      const Vec3 attained = second.barycentre_W - first.barycentre_W;
      const double commanded_m = (attained - (second.mean_error_W - first.mean_error_W)).norm();
      const double accuracy_m = attained.norm() - commanded_m;
      if (all.distance && all.distance->commanded_m >= commanded_m) continue;
      all.distance = DistanceCharacteristics{i, j, commanded_m, accuracy_m};
    }
  }
}

/// Mean time of a visit; absent if a reading has none.
std::optional<double> TimeOf(const std::vector<Reading>& readings, const Visit& visit) {
  double sum = 0;
  for (const std::size_t k : visit) {
    if (!readings[k].t_s) return std::nullopt;
    sum += *readings[k].t_s;
  }
  return sum / static_cast<double>(visit.size());
}

void AddDrift(const std::vector<Reading>& readings, const std::vector<PoseReadings>& poses,
              Characteristics& all) {
  double longest = 0;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    if (poses[k].visits.size() < 2) continue;
    const Visit &first = poses[k].visits.front(), &last = poses[k].visits.back();
    const auto from_s = TimeOf(readings, first), to_s = TimeOf(readings, last);
    const bool timed = from_s && to_s;
    const double length =
        timed ? *to_s - *from_s : static_cast<double>(last.front() - first.front());
    if (length <= longest) continue;
    longest = length;
    all.drift = DriftCharacteristics{
        k, static_cast<int>(first.size()), static_cast<int>(last.size()),
        timed ? std::optional(length) : std::nullopt,
        std::abs(MeanError(readings, last).norm() - MeanError(readings, first).norm())};
  }
}

}  // namespace

Characteristics CharacteristicsOf(const std::vector<Reading>& readings) {
  Characteristics all;
  if (readings.empty()) return all;
  const std::vector<PoseReadings> poses = ByPose(readings);
  for (const PoseReadings& pose : poses) all.poses.push_back(PoseOf(readings, pose));
  for (std::size_t k = 0; k < all.poses.size(); ++k) {
    const PoseCharacteristics& pose = all.poses[k];
    all.mean_accuracy_m += pose.accuracy_m / static_cast<double>(all.poses.size());
    if (pose.accuracy_m > all.poses[all.worst].accuracy_m) all.worst = k;
    if (!pose.repeatability_m) continue;
    if (!all.least_repeatable ||
        *pose.repeatability_m > *all.poses[*all.least_repeatable].repeatability_m) {
      all.least_repeatable = k;
    }
  }
  AddCycleScatter(readings, poses, all);
  AddDistances(all);
  AddDrift(readings, poses, all);
  return all;
}

}  // namespace plumbline::measure
