#include "app/hand_eye/hand_eye.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "app/hand_eye/hand_eye_fit.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/statistics/median.h"

namespace plumbline {
namespace {

constexpr std::size_t kFewestViews = 8;
constexpr double kLeastTurn_rad = 10 * std::numbers::pi / 180;  // about the second axis
constexpr double kMostRefused = 0.3;      // share of the views that may contradict the others
constexpr double kOutlier = 5;            // robust deviations of a view's robot error
constexpr double kWrongSize = 4.5;        // deviations at which the target's size is another
constexpr double kLeastWrongSize = 1e-3;  // and at least that much
constexpr double kWrongLens = 60;  // chi2; nine terms of a right one reach 46 once in a million
constexpr int kNoiseRounds = 12;
constexpr int kFolds = 5;

Vec3 MiddleOf(const HandEyeView& view) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : view.points_K) sum += p;
  return sum / static_cast<double>(std::max<std::size_t>(1, view.points_K.size()));
}

/// All that goes on from one set of views.
class Calibration {
 public:
  Calibration(std::vector<HandEyeView> views, const KnownLens& lens, const HandEyeOptions& options)
      : views_(std::move(views)), lens_(lens), options_(options) {}

  HandEye Run();

 private:
  void PlaceTargets();
  bool Start();
  void Adjust();
  HandEyePrior Prior() const { return PriorOf(lens_, options_, joints()); }
  bool LeaveOutWorst();
  void HoldOut();
  void CheckSize();
  void CheckLens();
  void Fill();
  void Decide();
  std::vector<PosePairing> PairingsWithout(int fold) const;
  HandEyeError ErrorOf(const HandEyeState& state, const Lens& lens, int fold) const;
  void Remove(std::size_t k, const std::string& reason);
  int joints() const {
    return options_.chain != nullptr && !views_.empty() ? static_cast<int>(views_[0].q.size()) : 0;
  }

  std::vector<HandEyeView> views_;
  KnownLens lens_;
  HandEyeOptions options_;
  std::vector<PosePairing> pairings_;  // of views_
  HandEyeState state_;
  HandEyeNoise noise_;
  HandEyeFit fit_;
  double lens_gain_ = 0;  ///< chi2 that another lens would gain
  HandEye answer_;
};

void Calibration::Remove(std::size_t k, const std::string& reason) {
  answer_.refused.push_back({views_[k].name, reason});
  const auto at = static_cast<std::ptrdiff_t>(k);
  views_.erase(views_.begin() + at);
  if (k < pairings_.size()) pairings_.erase(pairings_.begin() + at);
  if (k < state_.errors.size()) state_.errors.erase(state_.errors.begin() + at);
}

/// B of each view; a view without one goes. Half turns are put right.
void Calibration::PlaceTargets() {
  for (std::size_t k = 0; k < views_.size();) {
    const auto B = PoseOfPoints(lens_.lens, views_[k].points_K, views_[k].pixels);
    if (!B) {
      Remove(k, "too few corners of the target, or no pose fits them");
      continue;
    }
    const Pose X_BF = FlangePose(options_, views_[k], {});
    const bool to_hand = options_.setup == HandEyeSetup::kEyeToHand;
    pairings_.push_back({to_hand ? X_BF : X_BF.Inverse(), *B});
    ++k;
  }
  if (!options_.half_turns || views_.empty()) return;
  std::vector<bool> turned;
  const Vec3 middle = MiddleOf(views_[0]);
  PutHalfTurnsRight(pairings_, middle, turned);
  for (std::size_t k = 0; k < views_.size(); ++k) {
    if (!turned[k]) continue;
    for (Vec3& p : views_[k].points_K)
      p = Vec3(2 * middle.x() - p.x(), 2 * middle.y() - p.y(), p.z());
  }
}

bool Calibration::Start() {
  std::vector<bool> agreeing;
  const auto poses = SolveLinearRobust(pairings_, agreeing);
  if (!poses) return false;
  state_.poses = *poses;
  state_.lens = lens_.lens;
  state_.offsets = JointVector::Zero(joints());
  // Gross contradictions go at once: the robust start stands on more than half of the views. What
  // is off by no more than a robot's own error is left to the adjustment.
  constexpr double kGrossTurn_rad = 0.02, kGrossPlace_m = 0.01;
  for (std::size_t k = views_.size(); k-- > 0;) {
    const PairingMisfit misfit = MisfitOf(*poses, pairings_[k]);
    if (agreeing[k] || (misfit.place_m < kGrossPlace_m && misfit.turn_rad < kGrossTurn_rad))
      continue;
    Remove(k, fmt::format("contradicts the other images by {:.1f} mm and {:.1f} deg: another pose "
                          "than the image's, or the robot still moved",
                          1e3 * misfit.place_m, misfit.turn_rad * 180 / std::numbers::pi));
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

/// The view that errs most, if it does by more than its robust share; false where none does.
bool Calibration::LeaveOutWorst() {
  std::vector<double> sizes;
  for (std::size_t k = 0; k < views_.size(); ++k)
    sizes.push_back(std::max(fit_.place_misfit[k], fit_.turn_misfit[k]));
  std::vector<double> sorted = sizes;
  const double usual = std::max(1e-3, MedianOf(sorted));
  const auto worst =
      static_cast<std::size_t>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
  if (sizes[worst] < kOutlier * usual) return false;
  const Pose& E = state_.errors[worst];
  Remove(worst,
         fmt::format("the robot's pose is {:.2f} mm and {:.2f} deg off what the image shows, "
                     "far more than in the others: check its pose, and that it stood still",
                     1e3 * E.p.norm(), VectorFromRotation(E.R).norm() * 180 / std::numbers::pi));
  return true;
}

/// Those that belong to no fold (-1) or to another than this.
std::vector<PosePairing> Calibration::PairingsWithout(int fold) const {
  std::vector<PosePairing> chosen;
  for (std::size_t k = 0; k < pairings_.size(); ++k) {
    if (static_cast<int>(k) % kFolds != fold) chosen.push_back(pairings_[k]);
  }
  return chosen;
}

HandEyeError Calibration::ErrorOf(const HandEyeState& state, const Lens& lens, int fold) const {
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
    const Vec3 middle = MiddleOf(view);
    sums.position_m +=
        (X_CK * Vec3(state.size * middle) - state.size * (*seen * middle)).squaredNorm();
    ++views;
  }
  // As sums over the fold; the caller divides.
  sums.rms_px /= std::max(1.0, corners);
  sums.position_m /= std::max(1.0, views);
  return sums;
}

/// Each fifth image foretold by the others, the robot taken as it reports.
void Calibration::HoldOut() {
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
  answer_.linear = {std::sqrt(linear.rms_px / folds), std::sqrt(linear.position_m / folds)};
  answer_.adjusted = {std::sqrt(adjusted.rms_px / folds), std::sqrt(adjusted.position_m / folds)};
}

/// The robot's motion tells the size of the target: is it the one that was told?
void Calibration::CheckSize() {
  HandEyeState state = state_;
  HandEyeOptions options = options_;
  options.free_size = true;
  const HandEyeFit fit =
      FitHandEye(views_, options, PriorOf(lens_, options, joints()), noise_, state);
  if (!fit.converged) return;
  answer_.size_ratio = state.size;
  answer_.size_ratio_sd = std::sqrt(fit.covariance(kTargetSize, kTargetSize));
}

/// Would another lens, no farther off than what is known of it allows, fit far better?
void Calibration::CheckLens() {
  if (options_.free_lens) return;
  HandEyeState state = state_;
  HandEyeOptions options = options_;
  options.free_lens = true;
  const HandEyeFit fit =
      FitHandEye(views_, options, PriorOf(lens_, options, joints()), noise_, state);
  lens_gain_ = fit.converged ? fit_.cost - fit.cost : 0;
}

void Calibration::Fill() {
  answer_.camera.X = state_.poses.Y;
  answer_.target.X = state_.poses.X;
  answer_.camera.covariance = fit_.covariance.block<6, 6>(kCameraPlace, kCameraPlace);
  answer_.target.covariance = fit_.covariance.block<6, 6>(kTargetPlace, kTargetPlace);
  answer_.lens = lens_;
  if (options_.free_lens) {
    answer_.lens.lens = state_.lens;
    answer_.lens.covariance = fit_.covariance.block<9, 9>(kLensFirst, kLensFirst);
  }
  if (options_.free_joints && joints() > 0) {
    answer_.joint_offsets = state_.offsets;
    answer_.joint_offset_sds = JointVector::Zero(joints());
    for (int i = 1; i + 1 < joints(); ++i)
      answer_.joint_offset_sds[i] = std::sqrt(fit_.covariance(kOffsetFirst + i, kOffsetFirst + i));
  }
  answer_.sigma_px = noise_.corner_px;
  answer_.robot_m = noise_.robot_m;
  answer_.rms_px = fit_.rms_px;
  answer_.second_turn_rad = SecondTurn(pairings_);
  // A point that the camera sees: p = Y p_C, so d p = d place - Y.R [p_C]x d turn.
  double distance_m = 0;
  for (const PosePairing& pairing : pairings_)
    distance_m += pairing.B.p.norm() / static_cast<double>(pairings_.size());
  Eigen::Matrix<double, 3, 6> J;
  J.leftCols<3>().setIdentity();
  for (int axis = 0; axis < 3; ++axis) {
    J.col(3 + axis) = state_.poses.Y.R * Vec3::Unit(axis).cross(Vec3(0, 0, distance_m));
  }
  const Mat3 covariance = J * answer_.camera.covariance * J.transpose();
  answer_.point_sd_m = std::sqrt(std::max(0.0, covariance.trace() / 3));
  for (const HandEyeView& view : views_) answer_.used.push_back(view.name);
}

void Calibration::Decide() {
  const auto refuse = [&](std::string reason) { answer_.reasons.push_back(std::move(reason)); };
  const std::size_t all = answer_.used.size() + answer_.refused.size();
  if (answer_.used.size() < kFewestViews) {
    refuse(
        fmt::format("{} usable images are too few: take {} or more, the robot turned differently "
                    "in each",
                    answer_.used.size(), kFewestViews + 4));
  }
  if (answer_.second_turn_rad < kLeastTurn_rad) {
    refuse(
        fmt::format("the robot turned nearly about one axis only ({:.1f} deg about the second): "
                    "tilt the flange by 20 to 40 deg to all sides between the images",
                    answer_.second_turn_rad * 180 / std::numbers::pi));
  }
  if (static_cast<double>(answer_.refused.size()) > kMostRefused * static_cast<double>(all)) {
    refuse(
        fmt::format("{} of {} images contradict the others or show no target: check that poses "
                    "and images belong together, the convention of the poses, and that the "
                    "target sits tight",
                    answer_.refused.size(), all));
  }
  if (answer_.point_sd_m > options_.acceptable_m) {
    refuse(
        fmt::format("a point that the camera sees would be uncertain by {:.2f} mm, more than "
                    "{:.2f} mm: take more images, with larger turns and nearer to the target",
                    1e3 * answer_.point_sd_m, 1e3 * options_.acceptable_m));
  }
  const double off = std::abs(answer_.size_ratio - 1);
  if (!options_.free_size && off > kLeastWrongSize && off > kWrongSize * answer_.size_ratio_sd) {
    refuse(
        fmt::format("by the robot's motion the target is {:.2f} % {} than told: measure its "
                    "squares or tags, or calibrate the lens at this zoom",
                    100 * off, answer_.size_ratio > 1 ? "larger" : "smaller"));
  }
  if (lens_gain_ > kWrongLens) {
    refuse(
        "the images contradict the lens: calibrate it at this zoom and focus, or let it be "
        "adjusted "
        "here");
  }
  answer_.accepted = answer_.reasons.empty();
}

HandEye Calibration::Run() {
  PlaceTargets();
  const bool started = views_.size() >= 3 && Start();
  if (started) {
    Adjust();
    while (fit_.converged && views_.size() > kFewestViews && LeaveOutWorst()) Adjust();
  }
  if (!started || !fit_.converged) {
    for (const HandEyeView& view : views_) answer_.used.push_back(view.name);
    answer_.second_turn_rad = SecondTurn(pairings_);
    Decide();
    if (answer_.reasons.empty())
      answer_.reasons.emplace_back(
          "no pose of the camera fits: check that poses and images belong together, and the "
          "convention of the poses");
    answer_.accepted = false;
    answer_.camera = answer_.target = FoundPose{};
    return answer_;
  }
  HoldOut();
  CheckSize();
  CheckLens();
  Fill();
  Decide();
  return answer_;
}

}  // namespace

HandEye CalibrateHandEye(std::vector<HandEyeView> views, const KnownLens& lens,
                         const HandEyeOptions& options) {
  return Calibration(std::move(views), lens, options).Run();
}

}  // namespace plumbline
