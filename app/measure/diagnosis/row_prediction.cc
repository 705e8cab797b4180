#include "app/measure/diagnosis/row_prediction.h"

#include "firmware-like/geometry/rotation.h"

namespace plumbline::measure {
namespace {

using I = effects::Influence<double>;
using TipGradient = deflection::Sensitivity::Gradient;
constexpr int kFirstOfInstrument = I::kScale;  // these entries and all later ones

/// Sets residual and gradients of a measured position or pose: rows 0..2 for the TCP, rows 3..5 for
/// its orientation.
void SetPose(const MeasuredRow& measured, int count, const Mat3& R_FT, const TipAtRow& tip,
             LinearRow& row, Gradient& gradient) {
  const bool with_orientation = count == kMaxResiduals;
  row.residual.resize(count);
  row.residual.head<3>() = *measured.measured_W - row.p_W;
  row.frames.setZero(count, 9);
  row.frames.topRows<3>() = tip.frames;
  if (with_orientation) {
    const Mat3 R_WT = tip.at.state.X_WT.R * R_FT;
    row.residual.tail<3>() =
        VectorFromRotation(measured.orientation_W->toRotationMatrix() * R_WT.transpose());
    row.frames.bottomRows<3>().middleCols<3>(3).setIdentity();
    row.own.setZero(count, 3);
    row.own.bottomRows<3>() = R_WT;
  }
  if (!tip.gradients) return;
  gradient.resize(count, I::kSize);
  gradient.topRows<3>() = tip.at.dp;
  if (with_orientation) gradient.bottomRows<3>() = tip.at.dr;
}

/// Adds the error of the frame of the reference tags to the prediction of a position; see Model.
void AddTagsError(const Model& model, const Vec3& p_W, LinearRow& row) {
  row.residual -= model.tags_shift + model.tags_turn.cross(p_W);
  row.own.resize(3, 6);
  for (int axis = 0; axis < 3; ++axis) {
    row.own.col(axis) = Vec3::Unit(axis);
    row.own.col(3 + axis) = Vec3::Unit(axis).cross(p_W);
  }
}

/// Sets residual and gradients of a measured range, (1 + scale) |tip - anchor| + zero.
void SetRange(const Vec3& anchor_W, double range_m, const TipAtRow& tip, LinearRow& row,
              Gradient& gradient) {
  const Vec3 ray = row.p_W - anchor_W - tip.influence.Vector(I::kRangeAnchor);
  const double length = ray.norm();
  const Vec3 unit = length > 0 ? Vec3(ray / length) : Vec3::UnitX();
  const double enlarged = 1 + tip.influence[I::kScale];
  row.residual.setConstant(1, range_m - enlarged * length - tip.influence[I::kRangeZero]);
  row.frames = enlarged * unit.transpose() * tip.frames;
  if (!tip.gradients) return;
  gradient = enlarged * unit.transpose() * tip.at.dp;
  gradient(0, I::kScale) = length;
  gradient(0, I::kRangeZero) = 1;
  gradient.block<1, 3>(0, I::kRangeAnchor) = -enlarged * unit.transpose();
}

/// The TCP relative to an artefact, both in W.
struct Approach {
  Vec3 from_place;                     ///< from the artefact's place to the TCP
  Vec3 direction_W;                    ///< of a plane or gauge
  Mat3 R_WA;                           ///< from the artefact's frame to W
  Eigen::Matrix<double, 3, 9> frames;  ///< d from_place / d frames
  TipGradient gradient;                ///< d from_place / d influence, if requested
};

Approach ApproachOf(const model::Artefact& artefact, const PlacedArtefact& placed, const Pose& X_WB,
                    const TipAtRow& tip) {
  Approach approach;
  approach.R_WA = artefact.in_base ? X_WB.R : Mat3::Identity();
  const Vec3 place_W = artefact.in_base ? X_WB * placed.place : placed.place;
  approach.from_place = tip.at.state.X_WT.p - place_W;
  approach.direction_W = approach.R_WA * placed.direction;
  approach.frames = tip.frames;
  if (artefact.in_base) approach.frames.leftCols<6>().setZero();
  if (!tip.gradients) return approach;
  approach.gradient = tip.at.dp;
  approach.gradient.rightCols<I::kSize - kFirstOfInstrument>().setZero();
  if (artefact.in_base) approach.gradient.middleCols<8>(I::kBase).setZero();
  return approach;
}

/// Sets the derivatives of a prediction that moves by `along` . (change of from_place).
template <typename Along>
void SetAlong(const Approach& approach, const Along& along, bool gradients, LinearRow& row,
              Gradient& gradient) {
  row.frames = along * approach.frames;
  if (gradients) gradient = along * approach.gradient;
}

void SetTouch(const model::Artefact& artefact, const PlacedArtefact& placed,
              const Approach& approach, double reading_m, const TipAtRow& tip, LinearRow& row,
              Gradient& gradient) {
  const ArtefactFreedom freedom = FreedomOf(artefact);
  const Vec3& from_place = approach.from_place;
  if (artefact.kind == model::ArtefactKind::kPoint) {
    // In the artefact's frame, so that a place in the base frame moves exactly with the base.
    const Mat3 R_AW = approach.R_WA.transpose();
    row.residual = -R_AW * from_place;
    SetAlong(approach, R_AW, tip.gradients, row, gradient);
    row.own.resize(3, freedom.size());
    if (freedom.place == 3) row.own = -Mat3::Identity();
    return;
  }
  const bool sphere = artefact.kind == model::ArtefactKind::kSphere;
  const double length = from_place.norm();
  const Vec3 normal = !sphere      ? approach.direction_W
                      : length > 0 ? Vec3(from_place / length)
                                   : Vec3::UnitX();
  row.residual.setConstant(1, reading_m + placed.radius_m - normal.dot(from_place));
  SetAlong(approach, normal.transpose(), tip.gradients, row, gradient);
  row.own.resize(1, freedom.size());
  if (freedom.place == 3) row.own.leftCols<3>() = -normal.transpose() * approach.R_WA;
  if (freedom.place == 1) row.own(0, 0) = -1;
  if (freedom.direction == 2) {
    row.own.middleCols<2>(freedom.place) =
        (approach.R_WA.transpose() * from_place).transpose() * AcrossDirection(placed.direction);
  }
  if (freedom.radius == 1) row.own(0, freedom.place + freedom.direction) = -1;
}

/// Like SetRange, with the place of a point artefact as the anchor.
void SetArtefactRange(const model::Artefact& artefact, const Approach& approach, double range_m,
                      bool scaled, const TipAtRow& tip, LinearRow& row, Gradient& gradient) {
  const double length = approach.from_place.norm();
  const Vec3 unit = length > 0 ? Vec3(approach.from_place / length) : Vec3::UnitX();
  const double enlarged = scaled ? 1 + tip.influence[I::kScale] : 1;
  row.residual.setConstant(1, range_m - enlarged * length - tip.influence[I::kRangeZero]);
  SetAlong(approach, enlarged * unit.transpose(), tip.gradients, row, gradient);
  row.own.resize(1, FreedomOf(artefact).size());
  if (row.own.cols() == 3) row.own = -enlarged * unit.transpose() * approach.R_WA;
  if (!tip.gradients) return;
  if (scaled) gradient(0, I::kScale) = length;
  gradient(0, I::kRangeZero) = 1;
}

}  // namespace

void SetRow(const Dataset& data, const Model& model, RowIndex row, const TipAtRow& tip,
            LinearRow& result, Gradient& gradient) {
  const Observation& observation = data.observations[row];
  const MeasuredRow& measured = data.measured(row);
  const Model::Frames& frames = model.frames[data.session_of[row]];
  const int count = data.numbers[row].count;
  result.own.resize(count, 0);
  if (count == 0) {
    result.residual.resize(0);
    result.frames.resize(0, 9);
    gradient.resize(0, I::kSize);
  } else if (observation.kind == ObservationKind::kRange) {
    SetRange(data.cell.measurement.anchor_W, *measured.range_m, tip, result, gradient);
  } else if (!OnArtefact(observation.kind)) {
    SetPose(measured, count, frames.R_FT, tip, result, gradient);
    if (data.rests_on_tags(row)) AddTagsError(model, result.p_W, result);
  } else {
    const model::Artefact& artefact = data.cell.artefacts[observation.artefact.offset()];
    const PlacedArtefact& placed = model.artefacts[observation.artefact];
    const Approach approach = ApproachOf(artefact, placed, frames.X_WB, tip);
    if (observation.kind == ObservationKind::kArtefactRange) {
      SetArtefactRange(artefact, approach, *measured.range_m, !data.table.recorded.position, tip,
                       result, gradient);
    } else {
      const bool reads = observation.kind == ObservationKind::kGauge;
      SetTouch(artefact, placed, approach, reads ? *measured.gauge_m : 0, tip, result, gradient);
    }
  }
}

}  // namespace plumbline::measure
