#include "app/measure/diagnosis/placed_artefact.h"

#include <Eigen/Geometry>

namespace plumbline::measure {

ArtefactFreedom FreedomOf(const model::Artefact& artefact) {
  using model::ArtefactKind;
  const bool directed =
      artefact.kind == ArtefactKind::kPlane || artefact.kind == ArtefactKind::kGauge;
  ArtefactFreedom freedom;
  if (!artefact.place || artefact.sd_m > 0) freedom.place = directed ? 1 : 3;
  if (directed && !artefact.direction) freedom.direction = 2;
  if (artefact.kind == ArtefactKind::kSphere && (!artefact.radius_m || artefact.sd_m > 0)) {
    freedom.radius = 1;
  }
  return freedom;
}

PlacedArtefact DeclaredPlace(const model::Artefact& artefact) {
  return {artefact.place.value_or(Vec3::Zero()), artefact.direction.value_or(Vec3::UnitZ()),
          artefact.radius_m.value_or(0)};
}

Eigen::Matrix<double, 3, 2> AcrossDirection(const Vec3& direction) {
  Eigen::Matrix<double, 3, 2> across;
  across.col(0) = direction.unitOrthogonal();
  across.col(1) = direction.cross(across.col(0));
  return across;
}

void MoveArtefact(const ArtefactFreedom& freedom, const double* step, PlacedArtefact& artefact) {
  if (freedom.place == 3) artefact.place += Eigen::Map<const Vec3>(step);
  if (freedom.place == 1) artefact.place += *step * artefact.direction;
  step += freedom.place;
  if (freedom.direction == 2) {
    const Eigen::Map<const Eigen::Vector2d> turn(step);
    artefact.direction += AcrossDirection(artefact.direction) * turn;
    artefact.direction.normalize();
  }
  step += freedom.direction;
  if (freedom.radius == 1) artefact.radius_m += *step;
}

}  // namespace plumbline::measure
