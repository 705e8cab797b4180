#include "app/vision/hand_eye/pose_readings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "app/vision/hand_eye/hand_eye_fit.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::vision {
namespace {

using std::numbers::pi;

// A reading must leave less than a third of the misfit, and fit in itself.
constexpr double kFarBetter = 3;
constexpr double kMaxMisfit = 0.02;  // of the distance of the target
constexpr std::size_t kLeastViews = 6;
constexpr double kLeastRotation_rad = 10 * pi / 180;  // about the second axis, of the target in C
/// Largest rotation disagreement that counts, so that a wrong view has a bounded influence.
constexpr double kMaxDisagreement_rad = 0.1;
constexpr double kUnitTolerance = 0.06;  // of the logarithm of a ratio
constexpr double kLargestRatio = 1.5;    // no target is measured more wrongly

/// Relation of two lengths that is that of two units.
struct UnitRatio {
  double factor;     ///< > 1
  const char* unit;  ///< of what is too small by it
};

// Three numbers of an orientation, and what tables take them for.

/// Values of (a, b, c) that give a rotation; the usual one first.
using Numbers = std::array<Vec3, 2>;

Vec3 Wrapped(Vec3 angles) {
  for (double& angle : angles) angle = std::remainder(angle, 2 * pi);
  return angles;
}

/// Rotation by three angles about the axes of the moving frame.
struct Axes {
  int i, j, k;
  bool reversed;  ///< (c, b, a) is what turns about i, j, k
};

Mat3 RotationOf(const Axes& axes, const Vec3& numbers) {
  const Vec3 angles = axes.reversed ? numbers.reverse().eval() : numbers;
  const auto turn = [](double angle, int axis) {
    return RotationFromVector(angle * Vec3::Unit(axis));
  };
  return turn(angles[0], axes.i) * turn(angles[1], axes.j) * turn(angles[2], axes.k);
}

Numbers NumbersOf(const Axes& axes, const Mat3& R) {
  const Vec3 found = Wrapped(R.eulerAngles(axes.i, axes.j, axes.k));
  const double other = axes.i == axes.k ? -found[1] : pi - found[1];
  const Vec3 second = Wrapped({found[0] + pi, other, found[2] + pi});
  const bool usual = axes.i == axes.k ? found[1] >= 0 : std::abs(found[1]) <= pi / 2;
  Numbers numbers = usual ? Numbers{found, second} : Numbers{second, found};
  if (axes.reversed) {
    for (Vec3& one : numbers) one.reverseInPlace();
  }
  return numbers;
}

/// What three numbers of an orientation may be.
struct Form {
  const char* name;
  std::optional<Axes> axes;  ///< nullopt: a rotation vector

  Mat3 Rotation(const Vec3& numbers) const {
    return axes ? RotationOf(*axes, numbers) : RotationFromVector(numbers);
  }
  Numbers Of(const Mat3& R) const {
    if (axes) return NumbersOf(*axes, R);
    const Vec3 turn = VectorFromRotation(R);
    const double angle = turn.norm();
    return {turn, angle > 0 ? Vec3(turn * (1 - 2 * pi / angle)) : turn};
  }
};

constexpr int kX = 0, kY = 1, kZ = 2;
const std::array<Form, 6> kForms = {{
    {"a rotation vector", std::nullopt},
    {"angles about the fixed x, y, z (roll, pitch, yaw)", Axes{kZ, kY, kX, true}},
    {"angles about the moving x, y, z", Axes{kX, kY, kZ, false}},
    {"angles about the moving z, y, x (A, B, C)", Axes{kZ, kY, kX, false}},
    {"angles about the moving z, y, z", Axes{kZ, kY, kZ, false}},
    {"angles about the moving z, x, z", Axes{kZ, kX, kZ, false}},
}};

/// A way to understand a row of the table.
struct Reading {
  std::string text;  ///< what the table contains then, and the remedy
  /// Poses that the row may stand for, the usual one first.
  std::function<std::vector<Pose>(const Pose&)> of;
  /// Leaves the rotation angles between the views as they are, so only a solution can tell.
  bool same_angles = false;
};

std::vector<Reading> RotationReadings() {
  std::vector<Reading> readings;
  const auto permuted = [](std::array<int, 4> from) {
    return [from](const Pose& X) -> std::vector<Pose> {
      const Eigen::Quaterniond q(X.R);
      const std::array<double, 4> wxyz = {q.w(), q.x(), q.y(), q.z()};
      return {{Eigen::Quaterniond(wxyz[from[0]], wxyz[from[1]], wxyz[from[2]], wxyz[from[3]])
                   .toRotationMatrix(),
               X.p}};
    };
  };
  readings.push_back(
      {"the quaternions are in the order x, y, z, w, although the columns say w, x, "
       "y, z: give each column its name",
       permuted({3, 0, 1, 2}), true});
  readings.push_back(
      {"the quaternions are in the order w, x, y, z, although the columns say x, y, "
       "z, w: give each column its name",
       permuted({1, 2, 3, 0}), true});
  readings.push_back({"the orientations are inverted, the positions not: negate qx, qy, qz",
                      [](const Pose& X) -> std::vector<Pose> {
                        return {{X.R.transpose(), X.p}};
                      },
                      true});
  for (const Form& taken : kForms) {
    for (const Form& meant : kForms) {
      if (&taken == &meant) continue;
      readings.push_back(
          {fmt::format("the controller's numbers are {}, and were converted as {}: convert them "
                       "again",
                       meant.name, taken.name),
           [&taken, &meant](const Pose& X) {
             std::vector<Pose> poses;
             for (const Vec3& numbers : taken.Of(X.R))
               poses.push_back({meant.Rotation(numbers), X.p});
             return poses;
           }});
    }
    readings.push_back({fmt::format("the orientations are {} in radians, and were converted as "
                                    "degrees: convert them again",
                                    taken.name),
                        [&taken](const Pose& X) -> std::vector<Pose> {
                          const Vec3 degrees = taken.Of(X.R)[0];
                          return {{taken.Rotation(degrees * (180 / pi)), X.p}};
                        }});
  }
  return readings;
}

/// Pairings of the views by one reading; of each view one of several.
using Alternatives = std::vector<std::vector<PosePairing>>;

/// The misfit of the relation of two views: the robot and the target turn by the same angle.
double Disagreement(const PosePairing& a, const PosePairing& b) {
  const double by_robot = VectorFromRotation(a.A.R.transpose() * b.A.R).norm();
  const double by_camera = VectorFromRotation(a.B.R.transpose() * b.B.R).norm();
  return std::min(kMaxDisagreement_rad, std::abs(by_robot - by_camera));
}

struct Choice {
  std::vector<PosePairing> pairings;
  double disagreement_rad = 1e300;  ///< mean over all pairs of views
};

/// Chooses of each view the alternative that agrees best with the earlier views.
Choice Choose(const Alternatives& alternatives) {
  Choice best;
  for (const PosePairing& first : alternatives[0]) {
    Choice choice;
    choice.pairings = {first};
    double sum = 0;
    for (std::size_t k = 1; k < alternatives.size(); ++k) {
      double least = 1e300;
      const PosePairing* chosen = nullptr;
      for (const PosePairing& pairing : alternatives[k]) {
        double off = 0;
        for (const PosePairing& earlier : choice.pairings) off += Disagreement(earlier, pairing);
        if (off >= least) continue;
        least = off;
        chosen = &pairing;
      }
      sum += least;
      choice.pairings.push_back(*chosen);
    }
    const auto n = static_cast<double>(alternatives.size());
    choice.disagreement_rad = 2 * sum / (n * (n - 1));
    if (choice.disagreement_rad < best.disagreement_rad) best = std::move(choice);
  }
  return best;
}

/// How well a reading fits.
struct Fit {
  double misfit_m = 1e300;  ///< median over the views, at the target
  double scale = 1;         ///< of the robot's positions
};

Fit FitOf(const std::vector<PosePairing>& pairings, double distance_m, bool free_scale) {
  std::vector<bool> consistent;
  const auto poses = SolveLinearRobust(pairings, consistent, free_scale);
  if (!poses) return {};
  std::vector<double> misfits;
  for (const PosePairing& pairing : pairings) {
    const PairingMisfit misfit = MisfitOf(*poses, pairing);
    misfits.push_back(std::hypot(misfit.position_m, distance_m * misfit.rotation_rad));
  }
  return {statistics::MedianOf(misfits), poses->scale};
}

}  // namespace

std::string WrongUnitText(double ratio, double tolerance) {
  constexpr std::array<UnitRatio, 4> kRatios = {
      {{10, "centimetres"}, {25.4, "inches"}, {304.8, "feet"}, {1000, "metres"}}};
  const double off = std::abs(std::log(ratio));
  if (!(off > std::log(kLargestRatio))) return "";
  const bool larger = ratio > 1;
  const std::string finding =
      fmt::format("by the robot's motion the target is {:.4g} times {} than declared",
                  std::exp(off), larger ? "larger" : "smaller");
  for (const auto& [factor, unit] : kRatios) {
    if (std::abs(off - std::log(factor)) > tolerance) continue;
    if (!larger) {
      return fmt::format(
          "{}: the positions of the poses are probably in {}, not in millimetres (ratio {:g})",
          finding, unit, factor);
    }
    return fmt::format(
        "{}: the size of the target is probably in {}, not in millimetres (ratio {:g}){}", finding,
        unit, factor, factor == 1000 ? ", or the positions of the poses in micrometres" : "");
  }
  return finding +
         ": no target is measured that wrongly. Check the units of its size and of the poses, and "
         "that it is the declared one";
}

std::string BetterReadingText(const std::vector<HandEyeView>& views,
                              const std::vector<Pose>& targets, const HandEyeOptions& options) {
  if (views.size() < kLeastViews) return "";
  const bool to_hand = options.setup == HandEyeSetup::kEyeToHand;
  double distance_m = 0;
  for (const Pose& B : targets) distance_m += B.p.norm() / static_cast<double>(targets.size());
  const std::vector<Vec3>& points = views[0].points_K;
  Vec3 centre = Vec3::Zero();
  for (const Vec3& p : points) centre += p / static_cast<double>(points.size());
  Pose half;  // rotation of the target by half a turn about its centre
  half.R = Vec3(-1, -1, 1).asDiagonal();
  half.p = centre - half.R * centre;

  const auto read = [&](const Reading& reading) {
    Alternatives alternatives;
    for (std::size_t k = 0; k < views.size(); ++k) {
      std::vector<PosePairing>& of_view = alternatives.emplace_back();
      for (const Pose& X : reading.of(FlangePose(options, views[k], {}))) {
        const Pose A = to_hand ? X : X.Inverse();
        of_view.push_back({A, targets[k]});
        if (options.half_turn_symmetric) of_view.push_back({A, targets[k] * half});
      }
    }
    return Choose(alternatives);
  };

  const Choice given = read({"", [](const Pose& X) -> std::vector<Pose> { return {X}; }});
  std::vector<PosePairing> turns;  // of the target
  for (const PosePairing& pairing : given.pairings) turns.push_back({pairing.B, pairing.B});
  if (SecondAxisRotation(turns) < kLeastRotation_rad) return "";
  const Fit as_given = FitOf(given.pairings, distance_m, false);
  const double limit_m = std::min(as_given.misfit_m / kFarBetter, kMaxMisfit * distance_m);

  Fit best = FitOf(given.pairings, distance_m, true);
  std::string text;  // of the best reading; empty as given
  const auto try_reading = [&](const Reading& reading) {
    const Choice choice = read(reading);
    // The angles decide without a solution that it is no better.
    if (!reading.same_angles && choice.disagreement_rad > given.disagreement_rad) return;
    const Fit fit = FitOf(choice.pairings, distance_m, true);
    if (fit.misfit_m * 1.2 > best.misfit_m) return;
    best = fit;
    text = reading.text;
  };
  const bool by_joints = views[0].q.size() > 0;
  try_reading({fmt::format("{}the camera is {}: {}give --setup {}",
                           by_joints ? "" : "the poses are inverted (the base in the flange), or ",
                           to_hand ? "on the flange" : "fixed in the cell",
                           by_joints ? "" : "invert the poses, or ",
                           to_hand ? "eye-in-hand" : "eye-to-hand"),
               [](const Pose& X) -> std::vector<Pose> { return {X.Inverse()}; }, true});
  if (!by_joints) {
    for (const Reading& reading : RotationReadings()) try_reading(reading);
  }
  if (!(best.misfit_m < limit_m)) return "";
  const std::string unit = WrongUnitText(1 / best.scale, kUnitTolerance);
  if (text.empty()) return unit;
  const std::string misfit =
      as_given.misfit_m < 1e3
          ? fmt::format("the poses of the robot contradict the images by {:.0f} mm",
                        1e3 * as_given.misfit_m)
          : std::string("no rigid transformation fits the poses of the robot to the images");
  return fmt::format("{}. They fit to {:.1f} mm if {}{}", misfit, 1e3 * best.misfit_m, text,
                     unit.empty() ? "" : "; and " + unit);
}

}  // namespace plumbline::vision
