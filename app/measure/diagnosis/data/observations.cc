#include "app/measure/diagnosis/data/observations.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "app/base/text/text.h"

namespace plumbline::measure {
namespace {

using Kind = ObservationKind;

Kind TouchOf(model::ArtefactKind kind) {
  switch (kind) {
    case model::ArtefactKind::kPoint:
      return Kind::kPoint;
    case model::ArtefactKind::kSphere:
      return Kind::kSphere;
    case model::ArtefactKind::kPlane:
      return Kind::kPlane;
    case model::ArtefactKind::kGauge:
      break;
  }
  return Kind::kGauge;
}

Result<ArtefactIndex> ArtefactNamed(const model::CellModel& cell, const MeasuredRow& row) {
  std::vector<std::string> names;
  for (const model::Artefact& artefact : cell.artefacts) names.push_back(artefact.name);
  const auto found = std::ranges::find(names, row.artefact);
  if (found != names.end()) return ArtefactIndex(found - names.begin());
  const std::string nearest = text::NearestWord(row.artefact, names, 0.4);
  return Error{fmt::format(
      "line {}: artefact \"{}\" is not declared in the cell{}; add an [[artefact]] with that name, "
      "or correct the row",
      row.line, row.artefact, nearest.empty() ? "" : " (did you mean \"" + nearest + "\"?)")};
}

/// The observation of a row that names an artefact.
Result<Observation> OnNamedArtefact(const model::CellModel& cell, const MeasuredRow& row) {
  const Result<ArtefactIndex> index = ArtefactNamed(cell, row);
  if (!index) return Error{index.error()};
  const Kind touch = TouchOf(cell.artefacts[index->offset()].kind);
  const bool gauge = row.gauge_m.has_value();
  const bool range = row.range_m.has_value();
  const auto fault = [&](const char* column, const char* kind) {
    return Error{
        fmt::format("line {}: {} is filled, but artefact \"{}\" is of kind \"{}\", not \"{}\": "
                    "leave the cell empty, or name another artefact",
                    row.line, column, row.artefact, Describe(touch), kind)};
  };
  if (gauge && touch != Kind::kGauge) return fault("gauge_mm", "gauge");
  if (range && touch != Kind::kPoint) return fault("range_mm", "point");
  if (!gauge && touch == Kind::kGauge) {
    return Error{fmt::format(
        "line {}: artefact \"{}\" is a gauge, but gauge_mm is empty: write its reading, or leave "
        "artefact empty if nothing was measured",
        row.line, row.artefact)};
  }
  return Observation{range ? Kind::kArtefactRange : touch, *index};
}

}  // namespace

int ResidualsOf(ObservationKind kind) {
  switch (kind) {
    case Kind::kNone:
      return 0;
    case Kind::kPosition:
    case Kind::kPoint:
      return 3;
    case Kind::kPose:
      return 6;
    default:
      return 1;
  }
}

bool OnArtefact(ObservationKind kind) {
  return kind >= Kind::kPoint;
}

bool IsRange(ObservationKind kind) {
  return kind == Kind::kRange || kind == Kind::kArtefactRange;
}

const char* Describe(ObservationKind kind) {
  switch (kind) {
    case Kind::kNone:
      return "none";
    case Kind::kPosition:
    case Kind::kPose:
      return "position";
    case Kind::kRange:
    case Kind::kArtefactRange:
      return "range";
    case Kind::kPoint:
      return "point";
    case Kind::kSphere:
      return "sphere";
    case Kind::kPlane:
      return "plane";
    case Kind::kGauge:
      break;
  }
  return "gauge";
}

Result<PerRow<Observation>> ObservationsOf(const model::CellModel& cell,
                                           const MeasuredTable& table) {
  const bool anchored = cell.measurement.kind == model::MeasurementKind::kRange;
  PerRow<Observation> observations;
  for (const MeasuredRow& row : table.rows) {
    Observation& of_row = observations.emplace_back();
    const bool point = row.measured_W && !anchored;
    if (!row.artefact.empty() && !point) {
      const Result<Observation> on_artefact = OnNamedArtefact(cell, row);
      if (!on_artefact) return Error{on_artefact.error()};
      of_row = *on_artefact;
    } else if (anchored) {
      of_row.kind = row.range_m ? Kind::kRange : Kind::kNone;
    } else if (!point) {
      of_row.kind = Kind::kNone;
    } else {
      of_row.kind = row.orientation_W && cell.measurement.sigma_rad ? Kind::kPose : Kind::kPosition;
    }
  }
  return observations;
}

Vec3 LengthsOf(const RowResidual& residual) {
  Vec3 lengths = Vec3::Zero();
  const auto count = std::min<Eigen::Index>(residual.size(), 3);
  lengths.head(count) = residual.head(count);
  return lengths;
}

double SizeOf(const RowNumbers& numbers, const RowResidual& residual) {
  return std::sqrt(SquareOf(numbers, residual));
}

double SquareOf(const RowNumbers& numbers, const RowResidual& residual) {
  if (numbers.covariance.size() == 0) return residual.squaredNorm();
  const Eigen::LLT<Eigen::MatrixXd> cholesky(numbers.covariance);
  return cholesky.matrixL().solve(residual).squaredNorm();
}

}  // namespace plumbline::measure
