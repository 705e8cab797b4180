// Rows on artefacts: joint readings at which the TCP touches a fixed body, and readings of gauges
// and draw wires.
#pragma once

#include <string>
#include <vector>

#include "tests/simulator/design.h"

namespace simulator {

struct Artefact {
  std::string name;
  std::string kind;  ///< "point", "plane" or "gauge"
  Eigen::Vector3d at_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< of a plane or gauge
};

/// What stands in the cell. Its places are unknown to the cell file, except for known distances.
struct Artefacts {
  std::vector<Artefact> all;
  /// Pairs of sockets at a known distance [m], by position in `all`.
  struct Pair {
    std::size_t first, second;
    double distance_m;
  };
  std::vector<Pair> pairs;
};

/// Draws artefacts at tips of these rows, with the arm as declared:
///   "sockets"  printed tools with two sockets 50 mm apart, in so many places
///   "gauges"   a table that is touched, and three dial gauges
///   "wires"    so many fixed ends of a draw wire, which reads the distance to the TCP
/// @throws std::runtime_error for another word
Artefacts DrawArtefacts(const std::string& what, int places, const Cell& cell,
                        const std::vector<Row>& rows, Generator& random);

/// Assigns the rows to the artefacts in turn and changes their joint readings so that the TCP of
/// the arm with these effects is on the artefact, up to normal noise of the cell's sigma; gauges
/// and wires get a reading with that noise.
/// @throws std::runtime_error if no posture is found
void TouchArtefacts(const Artefacts& artefacts, const Cell& cell, const Effects& effects,
                    Table& table, Generator& random);

/// The `[[artefact]]` and `[[distance]]` tables of the cell file.
std::string ArtefactsText(const Artefacts& artefacts);

}  // namespace simulator
