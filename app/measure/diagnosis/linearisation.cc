#include "app/measure/diagnosis/linearisation.h"

#include <fmt/format.h>

#include <atomic>
#include <thread>
#include <vector>

#include "app/measure/diagnosis/block_columns.h"
#include "app/measure/diagnosis/row_prediction.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::measure {
using I = effects::Influence<double>;

Model Model::Declared(const Dataset& data) {
  Model model;
  model.frames.assign(data.sessions.size(),
                      {data.cell.robot.X_WB, data.cell.tool.tcp_F, Mat3::Identity()});
  for (const model::Artefact& artefact : data.cell.artefacts) {
    model.artefacts.push_back(DeclaredPlace(artefact));
  }
  return model;
}

model::CellModel CellOf(const Dataset& data, const Model& model, SessionIndex session) {
  model::CellModel cell = data.cell;
  const Model::Frames& frames = model.frames[session];
  cell.robot.X_WB = frames.X_WB;
  cell.tool.tcp_F = frames.tip_F;
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
  arms_.reserve(static_cast<std::size_t>(data.sessions_count()));
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
  effects::Influence<double> influence = arm.EffectsAt(moment);
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
  result.rows.resize(static_cast<std::size_t>(data.rows()));
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
    return term.effect->traits().parameters[static_cast<std::size_t>(term.parameters[k].spec)];
  };
  bool shapes = false, sizes = false;
  for (std::size_t k = 0; k < term.parameters.size(); ++k) {
    if (spec(k).value_of_linear != nullptr) return false;
    const bool size = spec(k).role == effects::ParameterRole::kSize;
    shapes = shapes || !size;
    sizes = sizes || (size && values[k] != 0);
  }
  if (shapes && sizes) return false;
  return std::all_of(which.begin(), which.end(), [&](int k) {
    return spec(static_cast<std::size_t>(k)).role == effects::ParameterRole::kSize;
  });
}

void AddLinearSlopes(const effects::EffectTerm& term, std::span<const double> values,
                     std::span<const int> which, const effects::Conditions& conditions,
                     std::vector<TermSlope>& slopes) {
  std::vector<double> one(values.begin(), values.end());
  for (std::size_t k = 0; k < one.size(); ++k) {
    const effects::TermParameter& own = term.parameters[k];
    const effects::ParameterSpec& spec =
        term.effect->traits().parameters[static_cast<std::size_t>(own.spec)];
    if (spec.role == effects::ParameterRole::kSize) one[k] = 0;
  }
  for (std::size_t k = 0; k < which.size(); ++k) {
    double& size = one[static_cast<std::size_t>(which[k])];
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
      duals[static_cast<std::size_t>(which[first + k])].v[static_cast<int>(k)] = 1;
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
  for (const TermSlope& of : slopes) out.col(of.column) += of.slope * gradient.col(of.entry);
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

void MoveFrames(Model::Frames& frames, const Eigen::Matrix<double, 9, 1>& step) {
  frames.X_WB.p += step.head<3>();
  frames.X_WB.R = RotationFromVector(step.segment<3>(3)) * frames.X_WB.R;
  frames.tip_F += step.tail<3>();
}

}  // namespace plumbline::measure
