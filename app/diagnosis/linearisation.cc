#include "app/diagnosis/linearisation.h"

#include <fmt/format.h>

#include <atomic>
#include <thread>
#include <vector>

#include "app/diagnosis/block_columns.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline {
namespace {

using I = Influence<double>;

/// The measured number of a range replaces the position: its gradient is along the ray.
void ToRange(const Vec3& anchor_W, double range_m, LinearRow& row) {
  const Vec3 ray = row.p_W - anchor_W;
  const double length = ray.norm();
  const Vec3 unit = length > 0 ? Vec3(ray / length) : Vec3::UnitX();
  row.residual = Vec3(range_m - length, 0, 0);
  const Eigen::Matrix<double, 1, I::kSize> along = unit.transpose() * row.dp;
  row.dp.setZero();
  row.dp.row(0) = along;
  const Eigen::Matrix<double, 1, 9> frames = unit.transpose() * row.frames;
  row.frames.setZero();
  row.frames.row(0) = frames;
}

}  // namespace

Model Model::Declared(const Dataset& data) {
  Model model;
  model.frames.assign(data.sessions.size(), {data.cell.robot.X_WB, data.cell.tool.tcp_F});
  return model;
}

CellModel CellOf(const Dataset& data, const Model& model, int session) {
  CellModel cell = data.cell;
  const Model::Frames& frames = model.frames[static_cast<std::size_t>(session)];
  cell.robot.X_WB = frames.X_WB;
  cell.tool.tcp_F = frames.tip_F;
  cell.sessions.clear();
  return cell;
}

void InParallel(int count, int threads, const std::function<void(int, int)>& f) {
  constexpr int kWorthAThread = 48;
  const int pieces = std::clamp(threads, 1, std::max(1, count / kWorthAThread));
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

Result<Linearisation> Linearise(const Dataset& data, const Model& model, bool gradients,
                                int threads) {
  std::vector<LoadedArm> arms;
  arms.reserve(static_cast<std::size_t>(data.sessions_count()));
  for (int session = 0; session < data.sessions_count(); ++session) {
    arms.emplace_back(CellOf(data, model, session));
  }
  Linearisation result;
  result.axes = data.axes();
  result.rows.resize(static_cast<std::size_t>(data.rows()));
  result.columns = std::make_shared<BlockColumns>();
  std::atomic<int> unsettled{-1};
  InParallel(data.rows(), threads, [&](int first, int last) {
    Sensitivity sensitivity;
    for (int k = first; k < last; ++k) {
      const auto at = static_cast<std::size_t>(k);
      const int session = data.session_of[at];
      const LoadedArm& arm = arms[static_cast<std::size_t>(session)];
      const Model::Frames& frames = model.frames[static_cast<std::size_t>(session)];
      const Conditions& moment = data.conditions[at];
      const MeasuredRow& measured = data.table.rows[at];
      Influence<double> influence;
      AddEffects(arm.effects(), moment, influence);
      AddEffects(model.effects, moment, influence);
      LinearRow& row = result.rows[at];
      bool settled = true;
      if (gradients) {
        settled =
            SensitivityAt(arm, measured.q, data.payloads[at], influence, moment.tau, sensitivity);
        row.dp = sensitivity.dp;
      } else {
        settled = arm.AtCommanded(measured.q, data.payloads[at], &influence, moment.tau,
                                  sensitivity.state);
        sensitivity.p_W = sensitivity.state.p_read_W;
        row.dp.setZero();
      }
      if (!settled) {
        unsettled = k;
        continue;
      }
      row.p_W = sensitivity.p_W;
      row.residual = measured.p_WT - row.p_W;
      const Vec3 arm_W = row.p_W - frames.X_WB.p;
      row.frames.leftCols<3>().setIdentity();
      for (int axis = 0; axis < 3; ++axis) {
        row.frames.col(3 + axis) = Vec3::Unit(axis).cross(arm_W);
      }
      row.frames.rightCols<3>() = frames.X_WB.R * sensitivity.state.posture.X_BF().R;
      if (result.axes == 1) ToRange(data.cell.measurement.anchor_W, measured.range_m, row);
    }
  });
  if (unsettled >= 0) {
    return Error{fmt::format(
        "{}:{}: the sagged posture does not settle; check compliance_rad_per_Nm and link_mass_kg",
        data.table.file, data.table.rows[static_cast<std::size_t>(unsettled.load())].line)};
  }
  return result;
}

namespace {

/// True where only sizes are asked for, and all are zero and linear: what the effect adds at one of
/// them is its derivative, without dual numbers.
bool LinearFromZero(const EffectTerm& term, std::span<const double> values,
                    std::span<const int> which) {
  const auto spec = [&](std::size_t k) -> const ParameterSpec& {
    return term.effect->traits().parameters[static_cast<std::size_t>(term.parameters[k].spec)];
  };
  for (std::size_t k = 0; k < term.parameters.size(); ++k) {
    const bool size = spec(k).role == ParameterRole::kSize;
    if (size && (values[k] != 0 || spec(k).value_of_linear != nullptr)) return false;
  }
  return std::all_of(which.begin(), which.end(), [&](int k) {
    return spec(static_cast<std::size_t>(k)).role == ParameterRole::kSize;
  });
}

}  // namespace

void TermColumns(const EffectTerm& term, std::span<const double> values, std::span<const int> which,
                 const Conditions& conditions, const LinearRow& row,
                 Eigen::Ref<Eigen::MatrixXd> out) {
  out.leftCols(static_cast<int>(which.size())).setZero();
  if (LinearFromZero(term, values, which)) {
    std::vector<double> one(values.begin(), values.end());
    for (std::size_t k = 0; k < which.size(); ++k) {
      double& size = one[static_cast<std::size_t>(which[k])];
      size = 1;
      Influence<double> influence;
      term.effect->Add(term, std::span<const double>(one.data(), one.size()), conditions,
                       influence);
      size = 0;
      for (int entry = 0; entry < I::kSize; ++entry) {
        const double slope = influence[entry];
        if (slope != 0) out.col(static_cast<int>(k)) += slope * row.dp.col(entry);
      }
    }
    return;
  }
  std::vector<Dual> duals(values.size());  // a periodic effect has three for each of its lines
  for (std::size_t first = 0; first < which.size(); first += kDualWidth) {
    const std::size_t count = std::min<std::size_t>(kDualWidth, which.size() - first);
    for (std::size_t k = 0; k < values.size(); ++k) duals[k] = Dual(values[k]);
    for (std::size_t k = 0; k < count; ++k) {
      duals[static_cast<std::size_t>(which[first + k])].v[static_cast<int>(k)] = 1;
    }
    Influence<Dual> influence;
    term.effect->Add(term, std::span<const Dual>(duals.data(), values.size()), conditions,
                     influence);
    for (int entry = 0; entry < I::kSize; ++entry) {
      for (std::size_t k = 0; k < count; ++k) {
        const double slope = influence[entry].v[static_cast<int>(k)];
        if (slope != 0) out.col(static_cast<int>(first + k)) += slope * row.dp.col(entry);
      }
    }
  }
}

void MoveFrames(Model::Frames& frames, const Eigen::Matrix<double, 9, 1>& step) {
  frames.X_WB.p += step.head<3>();
  frames.X_WB.R = RotationFromVector(step.segment<3>(3)) * frames.X_WB.R;
  frames.tip_F += step.tail<3>();
}

}  // namespace plumbline
