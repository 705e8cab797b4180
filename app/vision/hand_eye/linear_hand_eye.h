// Closed-form solution of A_k X = Y B_k for both unknown poses, used to initialize the adjustment.
#pragma once

#include <optional>
#include <vector>

#include "app/vision/hand_eye/hand_eye.h"

namespace plumbline::vision {

/// The unknowns. Y = X_BC and X = X_FK with A = X_BF (eye to hand), or Y = X_FC and X = X_BK with
/// A = X_BF^-1 (eye in hand); B = X_CK in both cases.
struct HandEyePoses {
  Pose Y, X;
  double scale = 1;  ///< of A's positions; 1 unless it is estimated
};

/// A view as a pair of poses.
struct PosePairing {
  Pose A, B;
};

/// Rotations from the singular vectors of sum R_B (x) R_A, then positions by least squares
/// [M. Shah, J. Mechanisms Robotics 5 (2013) 031007].
/// @param free_scale  estimate the unit of A's positions too
/// @return  nullopt for fewer than three pairings, or if all rotations are about one axis
std::optional<HandEyePoses> SolveLinear(const std::vector<PosePairing>& pairings,
                                        bool free_scale = false);

/// The same if some pairings are wrong: takes the solution from three pairings that has the least
/// median misfit over all pairings, and refines it with the pairings consistent with it.
/// Deterministic.
/// @param consistent  output: for each pairing, whether it is consistent with the solution
std::optional<HandEyePoses> SolveLinearRobust(const std::vector<PosePairing>& pairings,
                                              std::vector<bool>& consistent,
                                              bool free_scale = false);

/// Difference between A X and Y B: distance of the target's origins [m] and rotation angle [rad].
struct PairingMisfit {
  double position_m = 0, rotation_rad = 0;
};
PairingMisfit MisfitOf(const HandEyePoses& poses, const PosePairing& pairing);

/// Pose of the target in the camera from its points in one image.
/// @return  nullopt for fewer than six points, or if there is no solution
std::optional<Pose> PoseOfPoints(const lens::Lens& lens, const std::vector<Vec3>& points_K,
                                 const std::vector<lens::Vec2>& pixels);

/// RMS rotation between views about the second most used axis [rad]; zero if the robot rotated
/// about one axis only.
double SecondAxisRotation(const std::vector<PosePairing>& pairings);

/// Corrects poses of a target with half-turn symmetry: the rotation angle between two views must be
/// the same for robot and camera [R_A_ij is conjugate to R_B_ij].
/// @param centre_K  of the target; the half turn is about the z axis of K through it
/// @param turned    output: for each pairing, whether it was corrected
void ResolveHalfTurns(std::vector<PosePairing>& pairings, const Vec3& centre_K,
                      std::vector<bool>& turned);

}  // namespace plumbline::vision
