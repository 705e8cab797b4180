// Position of an artefact, and those of its constants that are estimated.
#pragma once

#include <Eigen/Core>

#include "firmware-like/model/artefact.h"

namespace plumbline::measure {

/// An artefact with all its constants, in the frame in which it is declared.
struct PlacedArtefact {
  Vec3 place = Vec3::Zero();
  Vec3 direction = Vec3::UnitZ();
  double radius_m = 0;
};

/// Number of estimated constants of an artefact: those that are not declared, or declared with a
/// standard deviation.
struct ArtefactFreedom {
  int place = 0;      ///< 3: a vector; 1: along the direction; 0: exactly known
  int direction = 0;  ///< 2: rotations about two axes across the direction
  int radius = 0;     ///< 1: of a sphere

  int size() const { return place + direction + radius; }
};

ArtefactFreedom FreedomOf(const model::Artefact& artefact);

/// The artefact as declared; what is absent is a placeholder.
PlacedArtefact DeclaredPlace(const model::Artefact& artefact);

/// Two unit vectors that are perpendicular to a direction and to each other, shape (3, 2).
Eigen::Matrix<double, 3, 2> AcrossDirection(const Vec3& direction);

/// Applies a step of the estimated constants, in the order of ArtefactFreedom.
void MoveArtefact(const ArtefactFreedom& freedom, const double* step, PlacedArtefact& artefact);

}  // namespace plumbline::measure
