#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "drivers/robot/decoding_parts.h"
#include "drivers/robot/reported_rotation.h"

namespace plumbline::robot {
namespace {

constexpr double kPoseTolerance_m = kLimits.tcp_tolerance_m,
                 kPoseTolerance_rad = kLimits.tcp_tolerance_rad;
constexpr double kMinDistance_m = 0.01;  // of a tool from the origin of the base
constexpr int kMaxOrientationGap = 16;
constexpr double kLengthRounding_m = 2e-4,
                 kAngleRounding_rad = 2e-4;  // to which cells are usually written
constexpr double kLever_m = 0.3;             // at which a rotation counts like a distance
constexpr double kRefresh_s = 0.02;          // between two registers of one cycle of a controller
constexpr double kUnclear_s = 0.1;           // uncertainty of a lead that decides nothing

struct PositionPlace {
  int first = 0, stride = 0;
  Encoding encoding{};
  double scale = 1, m = 1;
  const char* unit = "";
  Vec3 p = Vec3::Zero();
};

struct LengthUnit {
  const char* unit;
  double scale, m;
  bool real;
};
constexpr LengthUnit kLengths[] = {{"mm", 1, 1e-3, true},     {"m", 1, 1, true},
                                   {"mm", 1, 1e-3, false},    {"mm", 0.1, 1e-4, false},
                                   {"mm", 0.01, 1e-5, false}, {"mm", 0.001, 1e-6, false}};

/// Positions by cells of a grid.
class PositionGrid {
 public:
  PositionGrid(const RegisterImage& image, double reach_m) {
    for (const Encoding& encoding : Encodings()) {
      if (encoding.type == RegisterType::kUint16) continue;
      const RawValues raw(image, encoding);
      for (const LengthUnit& unit : kLengths) {
        if (unit.real != (encoding.type == RegisterType::kFloat32)) continue;
        for (const auto& [first, word] : image.words) {
          for (const int stride : kStrides) {
            if (stride < WordsOf(encoding.type)) continue;
            const Vec3 p = unit.m * Vec3(raw[first], raw[first + stride], raw[first + 2 * stride]);
            if (!p.allFinite() || p.norm() < kMinDistance_m || p.norm() > reach_m) continue;
            cells_[KeyOf(p, 0, 0, 0)].push_back(static_cast<int>(places_.size()));
            places_.push_back({first, stride, encoding, unit.scale, unit.m, unit.unit, p});
          }
        }
      }
    }
  }
  std::size_t size() const { return places_.size(); }

  template <typename Use>
  void ForEachNear(const Vec3& p, Use use) const {
    for (int x = -1; x <= 1; ++x) {
      for (int y = -1; y <= 1; ++y) {
        for (int z = -1; z <= 1; ++z) {
          const auto cell = cells_.find(KeyOf(p, x, y, z));
          if (cell == cells_.end()) continue;
          for (const int place : cell->second) use(places_[static_cast<std::size_t>(place)]);
        }
      }
    }
  }

  static constexpr double kCell_m = 0.025;

 private:
  static std::int64_t KeyOf(const Vec3& p, int x, int y, int z) {
    const auto index = [](double value, int more) {
      return static_cast<std::int64_t>(std::floor(value / kCell_m)) + more + (1 << 20);
    };
    return (index(p.x(), x) << 42) | (index(p.y(), y) << 21) | index(p.z(), z);
  }

  std::vector<PositionPlace> places_;
  std::unordered_map<std::int64_t, std::vector<int>> cells_;
};

struct PoseTolerance {
  double distance_m = kPoseTolerance_m, angle_rad = kPoseTolerance_rad;
};

/// What rounding of the joint registers adds to the tolerance of a tool at p_B.
PoseTolerance ToleranceOf(const JointDecoding& decoding, const kinematics::Chain& chain,
                          const kinematics::Posture& posture, const Vec3& p_B) {
  PoseTolerance tolerance;
  for (int j = 0; j < chain.size(); ++j) {
    const auto place = static_cast<std::size_t>(j);
    const double half = 0.5 * StepOf(decoding, chain, j);
    const bool turns = chain.type(j) == model::JointType::kRevolute;
    tolerance.distance_m +=
        half * (turns ? posture.axis_B[place].cross(p_B - posture.point_B[place]).norm() : 1);
    tolerance.angle_rad += turns ? half : 0;
  }
  return tolerance;
}

std::optional<Pose> PoseIn(const RegisterImage& image, const PoseDecoding& pose) {
  Vec3 position, angles;
  for (int k = 0; k < 3; ++k) {
    const auto place = static_cast<std::size_t>(k);
    const auto length = RawAt(image, pose.type, pose.order, pose.position[place]);
    const auto angle = RawAt(image, pose.type, pose.order, pose.orientation[place]);
    if (!length || !angle) return std::nullopt;
    position[k] = pose.length_m * *length;
    angles[k] = pose.angle_rad * *angle;
  }
  if (!position.allFinite() || !angles.allFinite() || angles.cwiseAbs().maxCoeff() > 2 * kWholeTurn)
    return std::nullopt;
  return Pose{RotationFromReported(angles, pose.convention), position};
}

struct PoseFit {
  bool agrees = false;
  double distance_m = 0, angle_rad = 0;
  double misfit = 0;
  double chance = 1;   ///< that a random pose within reach agrees as well, at all postures together
  bool moved = false;  ///< further than one pose can agree with
  bool exact = true;   ///< within the resolution of the registers and of the cell's lengths
};

PoseFit FitOfPose(const JointDecoding& joints, const PoseDecoding& pose, const Pose& X_FT,
                  const kinematics::Chain& chain, const std::vector<RegisterImage>& images,
                  double reach_m) {
  PoseFit fit;
  model::JointVector counted;
  std::optional<Pose> X_BT_first;
  for (const RegisterImage& image : images) {
    const auto q = Decoded(joints, chain, image);
    const auto reported = PoseIn(image, pose);
    if (!q || !reported) return fit;
    kinematics::Posture posture;
    chain.Evaluate(*q, posture);
    const Pose X_BT = posture.X_BF() * X_FT;
    const PoseTolerance tolerance = ToleranceOf(joints, chain, posture, X_BT.p);
    const double distance_m = (X_BT.p - reported->p).norm();
    const double angle_rad = VectorFromRotation(X_BT.R * reported->R.transpose()).norm();
    const double most_m = tolerance.distance_m + pose.length_m;
    const double most_rad =
        tolerance.angle_rad + 2 * pose.angle_rad * (pose.type == RegisterType::kFloat32 ? 0 : 1);
    if (distance_m > most_m || angle_rad > most_rad) return fit;
    fit.exact = fit.exact && distance_m < most_m - kPoseTolerance_m + kLengthRounding_m &&
                angle_rad < most_rad - kPoseTolerance_rad + kAngleRounding_rad;
    if (!X_BT_first) X_BT_first = X_BT;
    fit.moved = fit.moved || (X_BT.p - X_BT_first->p).norm() > 2 * most_m ||
                VectorFromRotation(X_BT.R * X_BT_first->R.transpose()).norm() > 2 * most_rad;
    fit.distance_m = std::max(fit.distance_m, distance_m);
    fit.angle_rad = std::max(fit.angle_rad, angle_rad);
    if (counted.size() == 0 || (*q - counted).cwiseAbs().maxCoeff() > 2 * kOffZero * kRadPerDeg) {
      counted = *q;
      const double near_m =
          std::max(distance_m, 0.3 * (tolerance.distance_m - kPoseTolerance_m) + 1e-4);
      const double near_rad =
          std::max(angle_rad, 0.3 * (tolerance.angle_rad - kPoseTolerance_rad) + 1e-4);
      fit.chance *= std::min(1.0, std::pow(near_m / reach_m, 3)) *
                    std::min(1.0, std::pow(near_rad, 3) / (6 * std::numbers::pi));
    }
  }
  fit.agrees = true;
  fit.misfit = std::hypot(fit.distance_m / kPoseTolerance_m, fit.angle_rad / kPoseTolerance_rad);
  return fit;
}

/// Time by which the joints are ahead of the pose, by regression of their difference over the
/// speed. A constant difference, such as that of a calibrated arm from its cell, does not count.
/// @return 0 if the speed does not explain the difference; nullopt if the images do not show that
std::optional<double> LeadOf(const JointDecoding& joints, const PoseDecoding& pose,
                             const Pose& X_FT, const kinematics::Chain& chain,
                             const std::vector<RegisterImage>& images) {
  const auto between = [](const Pose& from, const Pose& to) {
    Vec6 difference;
    difference << to.p - from.p, kLever_m * VectorFromRotation(to.R * from.R.transpose());
    return difference;
  };
  std::vector<Pose> computed, reported;
  std::vector<double> joints_s, pose_s;
  for (const RegisterImage& image : images) {
    const auto time_s = image.TimeOf(joints.addresses.front());
    const auto q = Decoded(joints, chain, image);
    const auto X_BT = PoseIn(image, pose);
    if (!time_s || !q || !X_BT) return std::nullopt;
    kinematics::Posture posture;
    chain.Evaluate(*q, posture);
    computed.push_back(posture.X_BF() * X_FT);
    reported.push_back(*X_BT);
    joints_s.push_back(*time_s);
    pose_s.push_back(image.TimeOf(pose.position.front()).value_or(*time_s));
  }
  std::vector<Vec6> speeds, differences;
  Vec6 mean_speed = Vec6::Zero(), mean_difference = Vec6::Zero();
  for (std::size_t k = 1; k + 1 < computed.size(); ++k) {
    const double time_s = joints_s[k + 1] - joints_s[k - 1];
    if (!(time_s > 0)) return std::nullopt;
    speeds.push_back(between(computed[k - 1], computed[k + 1]) / time_s);
    differences.push_back(between(reported[k], computed[k]) -
                          (joints_s[k] - pose_s[k]) * speeds.back());
    mean_speed += speeds.back();
    mean_difference += differences.back();
  }
  const auto count = static_cast<double>(speeds.size());
  if (count < 3) return std::nullopt;
  mean_speed /= count;
  mean_difference /= count;
  double square = 0, product = 0, remaining = 0;
  for (std::size_t k = 0; k < speeds.size(); ++k) {
    square += (speeds[k] - mean_speed).squaredNorm();
    product += (speeds[k] - mean_speed).dot(differences[k] - mean_difference);
  }
  if (!(square > 0)) return std::nullopt;
  const double lead_s = product / square;
  for (std::size_t k = 0; k < speeds.size(); ++k) {
    remaining +=
        (differences[k] - mean_difference - lead_s * (speeds[k] - mean_speed)).squaredNorm();
  }
  const double uncertainty_s = 2 * std::sqrt(remaining / (6 * count - 7) / square);
  if (std::abs(lead_s) > std::max(kRefresh_s, uncertainty_s)) return lead_s;
  if (uncertainty_s > kUnclear_s) return std::nullopt;
  return 0.0;
}

struct AngleUnit {
  const char* unit;
  double scale, rad;
  bool real;
};
constexpr AngleUnit kAngles[] = {{"deg", 1, kRadPerDeg, true},
                                 {"rad", 1, 1, true},
                                 {"mrad", 1, 1e-3, false},
                                 {"deg", 0.1, 0.1 * kRadPerDeg, false},
                                 {"deg", 0.01, 0.01 * kRadPerDeg, false},
                                 {"deg", 0.001, 0.001 * kRadPerDeg, false},
                                 {"mrad", 0.1, 1e-4, false},
                                 {"urad", 1, 1e-6, false}};

/// Calls use(PoseDecoding) for every orientation that may belong to a position.
template <typename Use>
void ForEachOrientation(const PositionPlace& place, Use use) {
  PoseDecoding pose;
  pose.type = place.encoding.type;
  pose.order = place.encoding.order;
  pose.length_unit = place.unit;
  pose.length_scale = place.scale;
  pose.length_m = place.m;
  for (int k = 0; k < 3; ++k)
    pose.position[static_cast<std::size_t>(k)] = place.first + k * place.stride;
  for (int gap = 0; gap <= kMaxOrientationGap; ++gap) {
    for (int k = 0; k < 3; ++k) {
      pose.orientation[static_cast<std::size_t>(k)] = place.first + (3 + k) * place.stride + gap;
    }
    for (const AngleUnit& unit : kAngles) {
      if (unit.real != (pose.type == RegisterType::kFloat32)) continue;
      pose.angle_unit = unit.unit;
      pose.angle_scale = unit.scale;
      pose.angle_rad = unit.rad;
      for (const ReportedOrientation convention :
           {ReportedOrientation::kRotationVector, ReportedOrientation::kRollPitchYaw,
            ReportedOrientation::kAbc, ReportedOrientation::kZyz}) {
        pose.convention = convention;
        use(pose);
      }
    }
  }
}

}  // namespace

std::vector<DecodingCandidate> WithPoses(const std::vector<DecodingCandidate>& all,
                                         const kinematics::Chain& chain,
                                         const DecodingEvidence& evidence,
                                         const SearchBounds& bounds, double& expected) {
  std::vector<Pose> tools = {Pose()};
  tools.insert(tools.end(), evidence.tools.begin(), evidence.tools.end());
  double reach_m = chain.Reach() + 0.05;
  for (const Pose& X_FT : tools) reach_m = std::max(reach_m, chain.Reach() + X_FT.p.norm() + 0.05);
  const RegisterImage& image = evidence.images.front();
  const PositionGrid grid(image, reach_m);
  std::vector<DecodingCandidate> found;
  double best_chance = 1, best_misfit = std::numeric_limits<double>::infinity();
  std::size_t orientations = 1;
  for (const DecodingCandidate& one : all) {
    if (bounds.stop && bounds.stop()) break;
    const auto q = Decoded(one.joints, chain, image);
    kinematics::Posture posture;
    chain.Evaluate(*q, posture);
    std::optional<DecodingCandidate> best;
    double best_fit = std::numeric_limits<double>::infinity();
    bool conventions_differ = false, exact = false;
    std::size_t tool = 0;
    for (std::size_t t = 0; t < tools.size(); ++t) {
      const Pose X_BT = posture.X_BF() * tools[t];
      const double near_m = ToleranceOf(one.joints, chain, posture, X_BT.p).distance_m;
      grid.ForEachNear(X_BT.p, [&](const PositionPlace& place) {
        if ((place.p - X_BT.p).norm() > near_m + place.m) return;
        std::size_t tried = 0;
        ForEachOrientation(place, [&](PoseDecoding pose) {
          ++tried;
          const auto reported = PoseIn(image, pose);
          if (!reported) return;
          pose.of_flange = t == 0;
          const PoseFit fit =
              FitOfPose(one.joints, pose, tools[t], chain, evidence.images, reach_m);
          if (!fit.agrees) return;
          const bool same_place = best && best->pose->orientation == pose.orientation &&
                                  best->pose->convention != pose.convention;
          if (same_place && std::abs(fit.misfit - best_fit) < kRivalFloor)
            conventions_differ = true;
          if (fit.misfit >= best_fit) return;
          // A clearly better fit makes the doubt about another one void.
          if (!same_place || best_fit - fit.misfit >= kRivalFloor) conventions_differ = false;
          best = one;
          best->with_pose = true;
          best->moved = fit.moved;
          best->pose = pose;
          best->distance_m = fit.distance_m;
          best->misfit = fit.misfit;
          best_fit = fit.misfit;
          exact = fit.exact;
          tool = t;
          if (fit.misfit < best_misfit) {
            best_misfit = fit.misfit;
            best_chance = fit.chance;
          }
        });
        orientations = std::max(orientations, tried);
      });
    }
    if (!best) continue;
    // An arm whose axes are moved one at a time is at standstill while it is read.
    if (best->moved && !exact && evidence.moves.empty())
      best->lead_s = LeadOf(one.joints, *best->pose, tools[tool], chain, evidence.images);
    if (conventions_differ) best->pose.reset();  // the joints are confirmed, the angles are not
    found.push_back(*best);
  }
  expected = best_chance * static_cast<double>(all.size()) * static_cast<double>(grid.size()) *
             static_cast<double>(tools.size() * orientations);
  return found;
}

}  // namespace plumbline::robot
