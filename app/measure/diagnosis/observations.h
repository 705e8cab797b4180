// Kinds of observation: what a row measures, and how many residuals that gives.
#pragma once

#include <optional>

#include "app/measure/diagnosis/indices.h"
#include "app/measure/table/csv.h"
#include "firmware-like/model/cell_model.h"
#include "firmware-like/result.h"

namespace plumbline::measure {

using ArtefactIndex = TypedIndex<struct ArtefactTag>;  ///< position in the cell's list

/// Quantity that a row measures. It follows from the cells of the row that are filled.
enum class ObservationKind {
  kNone,           ///< joints only
  kPosition,       ///< x, y, z of the TCP in W
  kPose,           ///< position and orientation of the TCP in W
  kRange,          ///< distance from the instrument's anchor to the TCP
  kPoint,          ///< the TCP is at a point artefact
  kSphere,         ///< the TCP is on a sphere
  kPlane,          ///< the TCP is on a plane
  kGauge,          ///< reading of a dial gauge that the TCP touches
  kArtefactRange,  ///< distance from a point artefact to the TCP
};

struct Observation {
  ObservationKind kind = ObservationKind::kPosition;
  ArtefactIndex artefact{};  ///< meaningful if OnArtefact(kind)
};

/// Number of residuals of a row of this kind: 0, 1, 3 or 6.
int ResidualsOf(ObservationKind kind);

/// True if the row refers to an artefact instead of an instrument's frame.
bool OnArtefact(ObservationKind kind);

/// True for the kinds that an instrument reads as a length along a ray.
bool IsRange(ObservationKind kind);

/// The kind as written in files: "position", "range", "point", "sphere", "plane", "gauge". Poses
/// are positions, and both kinds of range are ranges.
const char* Describe(ObservationKind kind);

/// The observation of each row of the table.
/// @return  an error with line, value and remedy if a row names an artefact that the cell lacks, or
///          its measured cells do not belong to that kind of artefact
Result<PerRow<Observation>> ObservationsOf(const model::CellModel& cell,
                                           const MeasuredTable& table);

}  // namespace plumbline::measure
