#include "app/vision/hand_eye/hand_eye.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/vision/hand_eye/hand_eye_fit.h"
#include "app/vision/hand_eye/pose_readings.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::vision {
namespace {

constexpr std::size_t kMinViews = 8;
constexpr double kMinRotation_rad = 10 * std::numbers::pi / 180;  // about the second axis
constexpr double kMaxRefused = 0.3;            // share of views that may be refused
constexpr double kOutlier = 5;                 // robust standard deviations of a view's robot error
constexpr double kSizeContradiction_sd = 4.5;  // standard deviations ..
constexpr double kMinSizeDifference = 1e-3;    // .. and absolute limit
constexpr double kLensContradiction_chi2 =
    60;  // nine correct parameters reach 46 once in a million
constexpr int kNoiseRounds = 12;
constexpr int kFolds = 5;

Vec3 CentreOf(const HandEyeView& view) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : view.points_K) sum += p;
  return sum / static_cast<double>(std::max<std::size_t>(1, view.points_K.size()));
}

/// State of one calibration run.
class Calibration {
 public:
  Calibration(std::vector<HandEyeView> views, const lens::KnownLens& lens,
              const HandEyeOptions& options)
      : views_(std::move(views)), lens_(lens), options_(options) {}

  HandEye Run();

 private:
  void LocateTargets();
  bool Initialize();
  int TargetTurn(const HandEyePoses& poses, std::size_t k, double position_m,
                 double rotation_rad) const;
  void Adjust();
  HandEyePrior Prior() const { return MakePrior(lens_, options_, joints()); }
  bool ExcludeWorst();
  void CrossValidate();
  void CheckSize();
  void CheckLens();
  void Fill();
  void Judge();
  std::vector<PosePairing> PairingsWithout(int fold) const;
  HandEyeError ErrorOf(const HandEyeState& state, const lens::Lens& lens, int fold) const;
  void Remove(std::size_t k, const std::string& reason);
  int joints() const {
    return options_.chain != nullptr && !views_.empty() ? static_cast<int>(views_[0].q.size()) : 0;
  }

  std::vector<HandEyeView> views_;
  lens::KnownLens lens_;
  HandEyeOptions options_;
  std::vector<PosePairing> pairings_;  // of views_
  std::vector<Pose> targets_;          // in C, of the views that Initialize() was given
  HandEyeState state_;
  HandEyeNoise noise_;
  HandEyeFit fit_;
  double lens_gain_ = 0;  ///< reduction of chi^2 with a free lens
  HandEye result_;
};

void Calibration::Remove(std::size_t k, const std::string& reason) {
  result_.refused.push_back({views_[k].name, reason});
  const auto at = static_cast<std::ptrdiff_t>(k);
  views_.erase(views_.begin() + at);
  if (k < pairings_.size()) pairings_.erase(pairings_.begin() + at);
  if (k < state_.errors.size()) state_.errors.erase(state_.errors.begin() + at);
}

/// Sets B of each view, removes views without a solution, and resolves half turns.
void Calibration::LocateTargets() {
  for (std::size_t k = 0; k < views_.size();) {
    const auto B = PoseOfPoints(lens_.lens, views_[k].points_K, views_[k].pixels);
    if (!B) {
      Remove(k, "too few corners of the target, or no pose fits them");
      continue;
    }
    const Pose X_BF = FlangePose(options_, views_[k], {});
    const bool to_hand = options_.setup == HandEyeSetup::kEyeToHand;
    pairings_.push_back({to_hand ? X_BF : X_BF.Inverse(), *B});
    targets_.push_back(*B);
    ++k;
  }
  if (!options_.half_turn_symmetric || views_.empty()) return;
  std::vector<bool> turned;
  const Vec3 centre = CentreOf(views_[0]);
  ResolveHalfTurns(pairings_, centre, turned);
  for (std::size_t k = 0; k < views_.size(); ++k) {
    if (!turned[k]) continue;
    for (Vec3& p : views_[k].points_K)
      p = Vec3(2 * centre.x() - p.x(), 2 * centre.y() - p.y(), p.z());
  }
}

/// Quarter turns of the target about its centre by which a view would agree with the others [deg];
/// 0 if none does.
int Calibration::TargetTurn(const HandEyePoses& poses, std::size_t k, double position_m,
                            double rotation_rad) const {
  const Vec3 centre = CentreOf(views_[k]);
  for (const int turn_deg : {180, 90, 270}) {
    Pose turn;
    turn.R = RotationFromVector(Vec3(0, 0, turn_deg * std::numbers::pi / 180));
    turn.p = centre - turn.R * centre;
    const PairingMisfit misfit = MisfitOf(poses, {pairings_[k].A, pairings_[k].B * turn});
    if (misfit.position_m < position_m && misfit.rotation_rad < rotation_rad) return turn_deg;
  }
  return 0;
}

bool Calibration::Initialize() {
  std::vector<bool> consistent;
  const auto poses = SolveLinearRobust(pairings_, consistent);
  if (!poses) return false;
  state_.poses = *poses;
  state_.lens = lens_.lens;
  state_.offsets = model::JointVector::Zero(joints());
  // Remove gross outliers now: the robust solution is supported by more than half of the views.
  // Deviations within a robot's own error are left to the adjustment.
  constexpr double kGrossRotation_rad = 0.02, kGrossPosition_m = 0.01;
  for (std::size_t k = views_.size(); k-- > 0;) {
    const PairingMisfit misfit = MisfitOf(*poses, pairings_[k]);
    if (consistent[k] ||
        (misfit.position_m < kGrossPosition_m && misfit.rotation_rad < kGrossRotation_rad))
      continue;
    const int turned_deg = TargetTurn(*poses, k, kGrossPosition_m, kGrossRotation_rad);
    Remove(k, turned_deg > 0
                  ? fmt::format("fits if the target is turned by {} deg about its normal: mount it "
                                "the same way in all images",
                                turned_deg)
                  : fmt::format(
                        "contradicts the other images by {:.1f} mm and {:.1f} deg: the pose "
                        "belongs to another image, or the robot was still moving",
                        1e3 * misfit.position_m, misfit.rotation_rad * 180 / std::numbers::pi));
  }
  return views_.size() >= 3;
}

void Calibration::Adjust() {
  const HandEyePrior prior = Prior();
  for (int round = 0; round < kNoiseRounds; ++round) {
    fit_ = FitHandEye(views_, options_, prior, noise_, state_);
    if (!fit_.converged) return;
    const double change = std::abs(std::log(fit_.noise.corner_px / noise_.corner_px)) +
                          std::abs(std::log(fit_.noise.robot_m / noise_.robot_m)) +
                          std::abs(std::log(fit_.noise.robot_rad / noise_.robot_rad));
    noise_ = fit_.noise;
    if (change < 0.02) return;
  }
}

/// Removes the view with the largest robot error if it is an outlier. @return whether it did
bool Calibration::ExcludeWorst() {
  std::vector<double> sizes;
  for (std::size_t k = 0; k < views_.size(); ++k)
    sizes.push_back(std::max(fit_.position_misfit[k], fit_.rotation_misfit[k]));
  std::vector<double> sorted = sizes;
  const double usual = std::max(1e-3, statistics::MedianOf(sorted));
  const auto worst = static_cast<std::size_t>(std::ranges::max_element(sizes) - sizes.begin());
  if (sizes[worst] < kOutlier * usual) return false;
  const Pose& E = state_.errors[worst];
  Remove(worst,
         fmt::format("the robot's pose differs from the image by {:.2f} mm and {:.2f} deg, far "
                     "more than in the others: check the pose, and that the robot was stationary",
                     1e3 * E.p.norm(), VectorFromRotation(E.R).norm() * 180 / std::numbers::pi));
  return true;
}

/// The pairings outside of this fold.
std::vector<PosePairing> Calibration::PairingsWithout(int fold) const {
  std::vector<PosePairing> chosen;
  for (std::size_t k = 0; k < pairings_.size(); ++k) {
    if (static_cast<int>(k) % kFolds != fold) chosen.push_back(pairings_[k]);
  }
  return chosen;
}

HandEyeError Calibration::ErrorOf(const HandEyeState& state, const lens::Lens& lens,
                                  int fold) const {
  HandEyeError sums;
  double corners = 0, views = 0;
  for (std::size_t k = 0; k < views_.size(); ++k) {
    if (static_cast<int>(k) % kFolds != fold) continue;
    const HandEyeView& view = views_[k];
    const Pose X_CK =
        ChainPose(options_, state.poses, FlangePose(options_, view, state.offsets), Pose{});
    for (std::size_t i = 0; i < view.pixels.size(); ++i) {
      const Vec3 p_C = X_CK * Vec3(state.size * view.points_K[i]);
      if (!(p_C.z() > 0)) continue;
      sums.rms_px += (Project(lens, p_C) - view.pixels[i]).squaredNorm();
      ++corners;
    }
    const auto seen = PoseOfPoints(lens, view.points_K, view.pixels);
    if (!seen) continue;
    const Vec3 centre = CentreOf(view);
    sums.position_m +=
        (X_CK * Vec3(state.size * centre) - state.size * (*seen * centre)).squaredNorm();
    ++views;
  }
  // Mean squares over the fold; the caller averages and takes the root.
  sums.rms_px /= std::max(1.0, corners);
  sums.position_m /= std::max(1.0, views);
  return sums;
}

/// Five-fold cross-validation, with the robot's poses as reported.
void Calibration::CrossValidate() {
  HandEyeError linear, adjusted;
  int folds = 0;
  const HandEyePrior prior = Prior();
  for (int fold = 0; fold < kFolds; ++fold) {
    HandEyeState start = state_;
    std::vector<HandEyeView> others;
    start.errors.clear();
    for (std::size_t k = 0; k < views_.size(); ++k) {
      if (static_cast<int>(k) % kFolds == fold) continue;
      others.push_back(views_[k]);
      start.errors.push_back(state_.errors[k]);
    }
    const auto by_linear = SolveLinear(PairingsWithout(fold));
    const HandEyeFit fit = FitHandEye(others, options_, prior, noise_, start);
    if (!by_linear || !fit.converged) continue;
    HandEyeState plain;
    plain.poses = *by_linear;
    const HandEyeError a = ErrorOf(plain, lens_.lens, fold), b = ErrorOf(start, start.lens, fold);
    linear.rms_px += a.rms_px;
    linear.position_m += a.position_m;
    adjusted.rms_px += b.rms_px;
    adjusted.position_m += b.position_m;
    ++folds;
  }
  if (folds == 0) return;
  result_.linear = {std::sqrt(linear.rms_px / folds), std::sqrt(linear.position_m / folds)};
  result_.adjusted = {std::sqrt(adjusted.rms_px / folds), std::sqrt(adjusted.position_m / folds)};
}

/// Estimates the target's size, which the robot's motion determines.
void Calibration::CheckSize() {
  HandEyeState state = state_;
  HandEyeOptions options = options_;
  options.free_size = true;
  const HandEyeFit fit =
      FitHandEye(views_, options, MakePrior(lens_, options, joints()), noise_, state);
  if (!fit.converged) return;
  result_.size_ratio = state.size;
  result_.size_ratio_sd = std::sqrt(fit.covariance(kTargetSize, kTargetSize));
}

/// Computes how much better a free lens within its prior would fit.
void Calibration::CheckLens() {
  if (options_.free_lens) return;
  HandEyeState state = state_;
  HandEyeOptions options = options_;
  options.free_lens = true;
  const HandEyeFit fit =
      FitHandEye(views_, options, MakePrior(lens_, options, joints()), noise_, state);
  lens_gain_ = fit.converged ? fit_.cost - fit.cost : 0;
}

void Calibration::Fill() {
  result_.camera.X = state_.poses.Y;
  result_.target.X = state_.poses.X;
  result_.camera.covariance = fit_.covariance.block<6, 6>(kCameraPosition, kCameraPosition);
  result_.target.covariance = fit_.covariance.block<6, 6>(kTargetPosition, kTargetPosition);
  result_.lens = lens_;
  if (options_.free_lens) {
    result_.lens.lens = state_.lens;
    result_.lens.covariance.topLeftCorner<9, 9>() =
        fit_.covariance.block<9, 9>(kLensFirst, kLensFirst);
  }
  if (options_.free_joints && joints() > 0) {
    result_.joint_offsets = state_.offsets;
    result_.joint_offset_sds = model::JointVector::Zero(joints());
    for (int i = 1; i + 1 < joints(); ++i)
      result_.joint_offset_sds[i] = std::sqrt(fit_.covariance(kOffsetFirst + i, kOffsetFirst + i));
  }
  result_.sigma_px = noise_.corner_px;
  result_.robot_m = noise_.robot_m;
  result_.rms_px = fit_.rms_px;
  result_.second_axis_rad = SecondAxisRotation(pairings_);
  // A point the camera sees: p = Y p_C, so d p = d position - Y.R [p_C]x d rotation.
  double distance_m = 0;
  for (const PosePairing& pairing : pairings_)
    distance_m += pairing.B.p.norm() / static_cast<double>(pairings_.size());
  Eigen::Matrix<double, 3, 6> J;
  J.leftCols<3>().setIdentity();
  for (int axis = 0; axis < 3; ++axis) {
    J.col(3 + axis) = state_.poses.Y.R * Vec3::Unit(axis).cross(Vec3(0, 0, distance_m));
  }
  const Mat3 covariance = J * result_.camera.covariance * J.transpose();
  result_.point_sd_m = std::sqrt(std::max(0.0, covariance.trace() / 3));
  for (const HandEyeView& view : views_) result_.used.push_back(view.name);
}

void Calibration::Judge() {
  const auto refuse = [&](std::string reason) { result_.reasons.push_back(std::move(reason)); };
  const std::size_t all = result_.used.size() + result_.refused.size();
  if (result_.used.size() < kMinViews) {
    refuse(fmt::format(
        "{} usable images are too few: take {} or more, with a different orientation of "
        "the robot in each",
        result_.used.size(), kMinViews + 4));
  }
  if (result_.second_axis_rad < kMinRotation_rad) {
    refuse(
        fmt::format("the robot rotated about nearly one axis only ({:.1f} deg about the second): "
                    "tilt the flange by 20 to 40 deg in all directions between the images",
                    result_.second_axis_rad * 180 / std::numbers::pi));
  }
  if (static_cast<double>(result_.refused.size()) > kMaxRefused * static_cast<double>(all)) {
    refuse(
        fmt::format("{} of {} images contradict the others or show no target: check that poses "
                    "and images match, the convention of the poses, and that the target is "
                    "firmly mounted",
                    result_.refused.size(), all));
  }
  if (result_.point_sd_m > options_.acceptable_m) {
    refuse(
        fmt::format("a point that the camera sees would be uncertain by {:.2f} mm, more than "
                    "{:.2f} mm: take more images, with larger turns and nearer to the target",
                    1e3 * result_.point_sd_m, 1e3 * options_.acceptable_m));
  }
  const double off = std::abs(result_.size_ratio - 1);
  const double tolerance =
      std::max(0.1, kSizeContradiction_sd * result_.size_ratio_sd / result_.size_ratio);
  const std::string unit =
      tolerance > std::log(2.0) ? "" : WrongUnitText(result_.size_ratio, tolerance);
  if (!unit.empty()) refuse(unit);
  if (unit.empty() && !options_.free_size && off > kMinSizeDifference &&
      off > kSizeContradiction_sd * result_.size_ratio_sd) {
    refuse(
        fmt::format("by the robot's motion the target is {:.2f} % {} than declared: measure its "
                    "squares or tags, or calibrate the lens at this zoom",
                    100 * off, result_.size_ratio > 1 ? "larger" : "smaller"));
  }
  if (lens_gain_ > kLensContradiction_chi2) {
    refuse(
        "the images contradict the lens: calibrate it at this zoom and focus, or estimate it here "
        "with --free-lens");
  }
  result_.accepted = result_.reasons.empty();
}

HandEye Calibration::Run() {
  LocateTargets();
  if (const std::string misread = BetterReadingText(views_, targets_, options_); !misread.empty()) {
    for (const HandEyeView& view : views_) result_.used.push_back(view.name);
    result_.second_axis_rad = SecondAxisRotation(pairings_);
    result_.reasons.push_back(misread);
    return result_;
  }
  const bool started = views_.size() >= 3 && Initialize();
  if (started) {
    Adjust();
    while (fit_.converged && views_.size() > kMinViews && ExcludeWorst()) Adjust();
  }
  if (!started || !fit_.converged) {
    for (const HandEyeView& view : views_) result_.used.push_back(view.name);
    result_.second_axis_rad = SecondAxisRotation(pairings_);
    Judge();
    if (result_.reasons.empty())
      result_.reasons.emplace_back(
          "no pose of the camera fits: check that poses and images match, and the convention of "
          "the poses");
    result_.accepted = false;
    result_.camera = result_.target = PoseWithCovariance{};
    return result_;
  }
  CrossValidate();
  CheckSize();
  CheckLens();
  Fill();
  Judge();
  return result_;
}

}  // namespace

HandEye CalibrateHandEye(std::vector<HandEyeView> views, const lens::KnownLens& lens,
                         const HandEyeOptions& options) {
  return Calibration(std::move(views), lens, options).Run();
}

}  // namespace plumbline::vision
