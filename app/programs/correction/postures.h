// Postures of the arm in which the programmed pose is reached.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "firmware-like/correction/correct.h"
#include "firmware-like/result.h"

namespace plumbline::programs {

/// A tool point and where it shall be, without load.
struct ArmTarget {
  Pose X_BP;                 ///< of the tool point, with the orientation of the tip T
  Vec3 p_TP = Vec3::Zero();  ///< the tool point in the tip's frame [m]
  int tool = 0;
};

/// Joints that bring the unloaded tool point to a target, by Newton's method from a seed, in the
/// turn within the limits nearest to the seed; nullopt if it leads nowhere.
std::optional<model::JointVector> PostureNear(const correction::Corrector& corrector,
                                              const ArmTarget& target,
                                              const model::JointVector& seed);

/// All postures that reach a target within the joint limits, whole turns of the joints included;
/// joints without limits are given within one turn of zero. Searches from a fixed sequence of
/// starts and from the mirror images of what they find, about a millisecond.
std::vector<model::JointVector> PosturesOf(const correction::Corrector& corrector,
                                           const ArmTarget& target);

/// In which posture a motion reaches its target?
struct PostureQuestion {
  ArmTarget target;
  /// Whether a posture agrees with what the point states; absent: every posture does.
  std::function<bool(const model::JointVector&)> agrees;
  bool states = false;  ///< the point states a posture
  /// Joints near which the motion ends: those that the file states, or those of the previous
  /// motion.
  std::optional<model::JointVector> seed;
  std::string no_seed;  ///< why there is none
  /// The targets on the way from the seed, by share 0..1, of a motion that keeps its posture: a
  /// linear or circular one. Absent: the motion may end in any posture.
  std::function<ArmTarget(double)> along;
};

/// Answers such questions, and remembers the postures that it found, so that many questions without
/// an answer do not take a search each.
class PostureSearch {
 public:
  /// The argument must outlive the object.
  explicit PostureSearch(const correction::Corrector& corrector) : corrector_(corrector) {}

  /// @return  the posture to which the path leads from the seed, if it can be followed and agrees;
  ///          an error if it does not agree. Without a path that can be followed, the nearest to
  ///          the seed that agrees; without a seed, the only one that agrees, in the turns nearest
  ///          to zero. Else why there is none, or none that can be chosen
  Result<model::JointVector> Choose(const PostureQuestion& question);

 private:
  const correction::Corrector& corrector_;
  std::vector<model::JointVector> last_;  ///< one of each branch, of the last search
};

}  // namespace plumbline::programs
