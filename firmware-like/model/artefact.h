// Artefacts: fixed bodies in the cell against which the TCP is measured without an instrument.
#pragma once

#include <optional>
#include <string>

#include "firmware-like/geometry/pose.h"

namespace plumbline::model {

enum class ArtefactKind {
  kPoint,   ///< one fixed point, such as a ball in a socket: the TCP is there
  kSphere,  ///< the TCP is on a sphere about `place`
  kPlane,   ///< the TCP is on the plane through `place` with normal `direction`
  kGauge,   ///< a dial gauge; it reads direction . (p - place) for a TCP at p
};

/// An artefact as declared. An absent value is an unknown constant of the artefact.
struct Artefact {
  std::string name;
  ArtefactKind kind = ArtefactKind::kPoint;
  std::optional<Vec3> place;       ///< xyz_mm: point, centre, or any point of the plane [m]
  std::optional<Vec3> direction;   ///< unit normal of a plane or unit direction of a gauge
  std::optional<double> radius_m;  ///< of a sphere
  double sd_m = 0;       ///< standard deviation of `place`, one axis, and of `radius_m`; 0: exact
  bool in_base = false;  ///< given in the frame of the robot base, otherwise in W
};

/// A known distance between two point artefacts, by their positions in the cell's list.
struct KnownDistance {
  int first = 0, second = 0;
  double value_m = 0;
  double sd_m = 0;  ///< standard deviation; 0: exact
};

}  // namespace plumbline::model
