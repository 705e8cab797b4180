#include "app/measure/diagnosis/linear/linearisation.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <atomic>
#include <thread>
#include <vector>

#include "app/measure/diagnosis/linear/blocks.h"
#include "firmware-like/geometry/rotation.h"

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

namespace {

// Residual of a row by its kind of observation, from the predicted TCP pose.

/// The predicted TCP at a row.
struct TipAtRow {
  const deflection::Sensitivity& at;  ///< gradients are valid only if requested
  const effects::Influence<double>& influence;
  Eigen::Matrix<double, 3, 9> frames;  ///< d tip / d (base translation, base rotation, tip)
  bool gradients = false;              ///< whether to set the row's gradient
};

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

/// Sets residual, gradient and derivatives with respect to the nuisances of a row:
///   position     r = measured - p_WT, with the errors of the instrument
///   orientation  r = rotation vector of R_measured (R_WT R_FT)^T
///   range        r = measured - ((1 + scale) |p - anchor| + zero)
///   point        r = a - p
///   sphere       r = radius - |p - a|
///   plane        r = n . (a - p)
///   gauge        r = reading - d . (p - a)
/// with p the TCP and a the artefact's position. Rows on an artefact involve no errors of an
/// instrument's frame; an artefact of the base frame moves with the base.
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
    SetPose(measured, count, frames.X_FT[data.payloads[row].tool].R, tip, result, gradient);
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

}  // namespace

using I = effects::Influence<double>;

Model Model::Declared(const Dataset& data) {
  Model model;
  Model::Frames declared{data.cell.robot.X_WB, {}};
  for (int tool = 0; tool < data.cell.tools(); ++tool) {
    declared.X_FT.push_back({Mat3::Identity(), data.cell.ToolAt(tool).tcp_F});
  }
  model.frames.assign(data.sessions.size(), declared);
  for (const model::Artefact& artefact : data.cell.artefacts) {
    model.artefacts.push_back(DeclaredPlace(artefact));
  }
  return model;
}

model::CellModel CellOf(const Dataset& data, const Model& model, SessionIndex session) {
  model::CellModel cell = data.cell;
  const Model::Frames& frames = model.frames[session];
  cell.robot.X_WB = frames.X_WB;
  for (int tool = 0; tool < cell.tools(); ++tool) cell.ToolAt(tool).tcp_F = frames.X_FT[tool].p;
  cell.sessions.clear();
  return cell;
}

void InParallel(int count, int threads, const std::function<void(int, int)>& f) {
  constexpr int kMinPerThread = 48;
  const int pieces = std::clamp(threads, 1, std::max(1, count / kMinPerThread));
  std::vector<std::thread> others;
  const auto begin = [&](int piece) {
    return static_cast<int>(std::int64_t{count} * piece / pieces);
  };
  for (int piece = 1; piece < pieces; ++piece) {
    others.emplace_back([&, piece] { f(begin(piece), begin(piece + 1)); });
  }
  f(0, begin(1));
  for (std::thread& other : others) other.join();
}

ModelAtRows::ModelAtRows(const Dataset& data, const Model& model) : data_(data), model_(model) {
  arms_.reserve(data.sessions_count());
  for (const SessionIndex session : data.sessions.indices()) {
    arms_.emplace_back(CellOf(data, model, session));
  }
}

bool ModelAtRows::At(RowIndex row, const deflection::InfluenceSet& wanted,
                     deflection::Sensitivity& scratch, LinearRow& result,
                     Gradient& gradient) const {
  const SessionIndex session = data_.session_of[row];
  const deflection::LoadedArm& arm = arms_[session];
  const Model::Frames& frames = model_.frames[session];
  const effects::Conditions& moment = data_.conditions[row];
  const MeasuredRow& measured = data_.measured(row);
  const int count = data_.numbers[row].count;
  effects::Influence<double> influence = arm.EffectsAt(moment, data_.payloads[row]);
  effects::AddEffects(model_.effects, moment, influence);
  if (wanted.any()) {
    if (!deflection::SensitivityAt(arm, measured.q, data_.payloads[row], influence, moment.tau,
                                   wanted, scratch, count == kMaxResiduals)) {
      return false;
    }
  } else {
    if (!arm.AtCommanded(measured.q, data_.payloads[row], &influence, moment.tau, scratch.state)) {
      return false;
    }
    scratch.p_W = scratch.state.p_read_W;
  }
  result.p_W = scratch.p_W;
  const Vec3 arm_W = result.p_W - frames.X_WB.p;
  Eigen::Matrix<double, 3, 9> of_frames;
  of_frames.leftCols<3>().setIdentity();
  for (int axis = 0; axis < 3; ++axis) {
    of_frames.col(3 + axis) = Vec3::Unit(axis).cross(arm_W);
  }
  of_frames.rightCols<3>() = frames.X_WB.R * scratch.state.posture.X_BF().R;
  SetRow(data_, model_, row, {scratch, influence, of_frames, wanted.any()}, result, gradient);
  return true;
}

Result<Linearisation> Linearise(const Dataset& data, const Model& model, bool gradients,
                                int threads) {
  return Linearise(data, model,
                   gradients ? deflection::InfluenceSet{}.set() : deflection::InfluenceSet{},
                   threads);
}

Result<Linearisation> Linearise(const Dataset& data, const Model& model,
                                const deflection::InfluenceSet& wanted, int threads) {
  const ModelAtRows at_rows(data, model);
  Linearisation result;
  result.layout = data.layout();
  result.rows.resize(data.rows());
  if (wanted.any()) result.gradients.resize(result.rows.size());
  result.columns = std::make_shared<BlockColumns>();
  std::atomic<int> diverged{-1};
  InParallel(data.rows(), threads, [&](int first, int last) {
    deflection::Sensitivity scratch;
    Gradient gradient;
    for (const RowIndex row : IndexRange(RowIndex(first), RowIndex(last))) {
      if (!at_rows.At(row, wanted, scratch, result.rows[row], gradient)) {
        diverged = row.value();
      } else if (wanted.any()) {
        result.gradients[row] = gradient;
      }
    }
  });
  if (diverged >= 0) {
    return Error{
        fmt::format("{}:{}: the deflected posture does not converge; check compliance_rad_per_Nm "
                    "and link_mass_kg",
                    data.table.file, data.measured(RowIndex(diverged.load())).line)};
  }
  return result;
}

PerRow<RowResidual> ResidualsOf(const Linearisation& linear) {
  PerRow<RowResidual> residuals;
  residuals.reserve(linear.rows.size());
  for (const LinearRow& row : linear.rows) residuals.push_back(row.residual);
  return residuals;
}

RowResidual DisplacementBy(const std::vector<effects::ActiveEffect>& effects, const Dataset& data,
                           const Linearisation& linear, RowIndex row) {
  effects::Influence<double> influence;
  effects::AddEffects(effects, data.conditions[row], influence);
  const Gradient& gradient = linear.gradients[row];
  RowResidual displacement = RowResidual::Zero(gradient.rows());
  for (int entry = 0; entry < I::kSize; ++entry) {
    if (influence[entry] != 0) displacement += influence[entry] * gradient.col(entry);
  }
  return displacement;
}

PerRow<Vec3> ErrorsOf(const Linearisation& linear) {
  PerRow<Vec3> errors;
  errors.reserve(linear.rows.size());
  for (const LinearRow& row : linear.rows) errors.push_back(LengthsOf(row.residual));
  return errors;
}

namespace {

/// True if only sizes are requested, all of them are linear, and the other parameters are zero or
/// irrelevant. The contribution of the effect with one size set to 1 is then the derivative, and
/// dual numbers are not needed.
bool LinearInSizes(const effects::EffectTerm& term, std::span<const double> values,
                   std::span<const int> which) {
  const auto spec = [&](std::size_t k) -> const effects::ParameterSpec& {
    return term.effect->traits().parameters[term.parameters[k].spec];
  };
  bool shapes = false, sizes = false;
  for (std::size_t k = 0; k < term.parameters.size(); ++k) {
    if (spec(k).value_of_linear != nullptr) return false;
    const bool size = spec(k).role == effects::ParameterRole::kSize;
    shapes = shapes || !size;
    sizes = sizes || (size && values[k] != 0);
  }
  if (shapes && sizes) return false;
  return std::ranges::all_of(which, [&](int k) {
    return spec(static_cast<std::size_t>(k)).role == effects::ParameterRole::kSize;
  });
}

void AddLinearSlopes(const effects::EffectTerm& term, std::span<const double> values,
                     std::span<const int> which, const effects::Conditions& conditions,
                     std::vector<TermSlope>& slopes) {
  std::vector<double> one(values.begin(), values.end());
  for (std::size_t k = 0; k < one.size(); ++k) {
    const effects::TermParameter& own = term.parameters[k];
    const effects::ParameterSpec& spec = term.effect->traits().parameters[own.spec];
    if (spec.role == effects::ParameterRole::kSize) one[k] = 0;
  }
  for (std::size_t k = 0; k < which.size(); ++k) {
    double& size = one[which[k]];
    size = 1;
    effects::Influence<double> influence;
    term.effect->Add(term, std::span<const double>(one.data(), one.size()), conditions, influence);
    size = 0;
    for (int entry = 0; entry < I::kSize; ++entry) {
      const double slope = influence[entry];
      if (slope != 0) slopes.push_back({entry, static_cast<int>(k), slope});
    }
  }
}

}  // namespace

void AddTermSlopes(const effects::EffectTerm& term, std::span<const double> values,
                   std::span<const int> which, const effects::Conditions& conditions,
                   std::vector<TermSlope>& slopes) {
  if (LinearInSizes(term, values, which)) {
    AddLinearSlopes(term, values, which, conditions, slopes);
    return;
  }
  std::vector<effects::Dual> duals(
      values.size());  // a periodic effect has three for each of its lines
  for (std::size_t first = 0; first < which.size(); first += effects::kDualWidth) {
    const std::size_t count = std::min<std::size_t>(effects::kDualWidth, which.size() - first);
    for (std::size_t k = 0; k < values.size(); ++k) duals[k] = effects::Dual(values[k]);
    for (std::size_t k = 0; k < count; ++k) {
      duals[which[first + k]].v[static_cast<int>(k)] = 1;
    }
    effects::Influence<effects::Dual> influence;
    term.effect->Add(term, std::span<const effects::Dual>(duals.data(), values.size()), conditions,
                     influence);
    for (int entry = 0; entry < I::kSize; ++entry) {
      for (std::size_t k = 0; k < count; ++k) {
        const double slope = influence[entry].v[static_cast<int>(k)];
        if (slope != 0) slopes.push_back({entry, static_cast<int>(first + k), slope});
      }
    }
  }
}

void TermColumns(const effects::EffectTerm& term, std::span<const double> values,
                 std::span<const int> which, const effects::Conditions& conditions,
                 const Gradient& gradient, Eigen::Ref<Eigen::MatrixXd> out) {
  out.leftCols(static_cast<int>(which.size())).setZero();
  std::vector<TermSlope> slopes;
  AddTermSlopes(term, values, which, conditions, slopes);
  for (const TermSlope& slope : slopes)
    out.col(slope.column) += slope.slope * gradient.col(slope.entry);
}

void CopyBasePosesToRows(const Model& model, Dataset& data) {
  Indexed<SessionIndex, std::shared_ptr<const model::Robot>> robots;
  for (const Model::Frames& frames : model.frames) {
    model::Robot robot = data.cell.robot;
    robot.X_WB = frames.X_WB;
    robots.push_back(std::make_shared<const model::Robot>(std::move(robot)));
  }
  for (const RowIndex row : data.conditions.indices()) {
    data.conditions[row].robot = robots[data.session_of[row]];
  }
}

void MoveBase(Pose& X_WB, const Eigen::Matrix<double, 6, 1>& step) {
  X_WB.p += step.head<3>();
  X_WB.R = RotationFromVector(step.tail<3>()) * X_WB.R;
}

}  // namespace plumbline::measure
