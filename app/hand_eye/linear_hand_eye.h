// A start without a start: both unknown poses of A_k X = Y B_k by linear algebra.
#pragma once

#include <optional>
#include <vector>

#include "app/hand_eye/hand_eye.h"

namespace plumbline {

/// Both unknowns. Y = X_BC and X = X_FK with A = X_BF (eye to hand), or Y = X_FC and X = X_BK with
/// A = X_BF^-1 (eye in hand); B = X_CK in both.
struct HandEyePoses {
  Pose Y, X;
};

/// A view as the linear method takes it.
struct PosePairing {
  Pose A, B;
};

/// The rotations from the singular vectors of sum R_B (x) R_A, then the places by least squares
/// [M. Shah, J. Mechanisms Robotics 5 (2013) 031007].
/// @return  nothing for fewer than three pairings, or where all turns are about one axis
std::optional<HandEyePoses> SolveLinear(const std::vector<PosePairing>& pairings);

/// The same where some pairings are wrong: the solution of three of them with the least median
/// misfit of all, then of all that agree with it. Deterministic.
/// @param agreeing  gets which they are
std::optional<HandEyePoses> SolveLinearRobust(const std::vector<PosePairing>& pairings,
                                              std::vector<bool>& agreeing);

/// Misfit of a pairing: distance of the two ways to the target's origin [m], and angle [rad].
struct PairingMisfit {
  double place_m = 0, turn_rad = 0;
};
PairingMisfit MisfitOf(const HandEyePoses& poses, const PosePairing& pairing);

/// Pose of the target in the camera from its points in one image, by the lens given.
/// @return  nothing for fewer than six points, or where none fits
std::optional<Pose> PoseOfPoints(const Lens& lens, const std::vector<Vec3>& points_K,
                                 const std::vector<Vec2>& pixels);

/// RMS turn between views about the axis that is second to the most used [rad]: zero where the
/// robot turned about one axis only.
double SecondTurn(const std::vector<PosePairing>& pairings);

/// Puts right targets that may be taken for half a turn of themselves: the turn between two views
/// is as large by the robot as by the camera [R_A_ij is conjugate to R_B_ij].
/// @param middle_K  of the target, about which the half turn (about K's z) leaves it alike
void PutHalfTurnsRight(std::vector<PosePairing>& pairings, const Vec3& middle_K,
                       std::vector<bool>& turned);

}  // namespace plumbline
