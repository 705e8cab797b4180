#include "app/cli/tip_prediction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "app/base/config/point_solutions.h"
#include "app/measure/table/conditions.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/deflection/uncertainty.h"
#include "firmware-like/effects/event_time_uncertainty.h"
#include "firmware-like/loads/numbered_load.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::cli {
namespace {

/// True if it is unknown whether an event of the model has happened at this moment.
bool EventStateUnknown(const deflection::LoadedArm& arm, const effects::Conditions& moment) {
  return std::any_of(arm.effects().begin(), arm.effects().end(),
                     [&](const effects::ActiveEffect& effect) {
                       return effects::UncertaintyOfEventTime(effect, moment).has_value();
                     });
}

/// 95 % radius of the tip due to the uncertainty of the session's frames [m].
///   p_W = X_WB (p_BF + R_BF tip):  dp = dbase + turn x (p_W - base) + R_WB R_BF dtip
double FrameRadius(const measure::FrameCovariance& covariance, const Pose& X_WB,
                   const deflection::LoadedState& state) {
  Eigen::Matrix<double, 3, 9> J;
  J.leftCols<3>().setIdentity();
  const Vec3 arm_W = state.p_read_W - X_WB.p;
  for (int axis = 0; axis < 3; ++axis) J.col(3 + axis) = Vec3::Unit(axis).cross(arm_W);
  J.rightCols<3>() = X_WB.R * state.posture.X_BF().R;
  return statistics::RadiusHolding95Percent(J * covariance * J.transpose());
}

/// Displacement of the tip as the frames of its session blend into those of the declared model,
/// because the correction fades with distance [m].
/// @param cell   holds only the frames of the row's session
/// @param index  of the row's tool, CellModel::ToolAt
Vec3 MovedByFading(const model::CellModel& cell, int index, double share,
                   const deflection::LoadedState& state) {
  if (share == 1 || cell.sessions.empty()) return Vec3::Zero();
  const model::SessionFrames& frames = cell.sessions.front();
  const Pose& X_BF = state.posture.X_BF();
  const model::Tool& tool = cell.ToolAt(index);
  Vec3 tip_F = tool.tcp_F;
  for (const model::SessionTip& tip : frames.tips) {
    if (tip.declared_F && (!tip.tool || tip.tool == tool.number)) tip_F = *tip.declared_F;
  }
  const Vec3 faded_W = frames.X_WB_declared.value_or(cell.robot.X_WB) * (X_BF * tip_F);
  return (1 - share) * (faded_W - cell.robot.X_WB * (X_BF * tool.tcp_F));
}

/// The cell of one session, and what depends only on it.
struct SessionArm {
  model::CellModel cell;
  deflection::LoadedArm arm;
  deflection::LandingUncertainty uncertainty;
  std::vector<measure::FrameCovariance> frames;  ///< of each tool
  std::vector<bool> tip_elsewhere;               ///< of each tool: not measured in the session
};

/// Arms of the sessions that occur in a table, each built once. A session that the cell does not
/// list has the frames of the last one.
class SessionArms {
 public:
  /// The arguments must outlive the object.
  SessionArms(const model::CellModel& cell, const model::DeclaredDeviation& deviation,
              const measure::FrameCovariances& aligned)
      : cell_(cell), bare_(cell), deviation_(deviation), aligned_(aligned) {
    bare_.sessions.clear();
    for (const model::SessionFrames& session : cell.sessions) {
      by_id_.emplace(session.id, &session);
      deflection::ApplyTips(session, bare_);  // the last that states a tool's tip
    }
    if (!cell.sessions.empty()) last_ = &cell.sessions.back();
  }

  SessionArm& Of(const std::string& session) {
    if (const auto known = arms_.find(session); known != arms_.end()) return known->second;
    model::CellModel cell = deflection::CellOfSession(CellWithFrames(session), session);
    deflection::LoadedArm arm(cell);
    deflection::LandingUncertainty uncertainty(cell, arm, deviation_);
    std::vector<bool> tip_elsewhere = TipsElsewhere(cell);
    std::vector<measure::FrameCovariance> frames = CovarianceOf(session, tip_elsewhere);
    return arms_
        .emplace(session, SessionArm{std::move(cell), std::move(arm), std::move(uncertainty),
                                     std::move(frames), std::move(tip_elsewhere)})
        .first->second;
  }

 private:
  /// The cell with the frames of a single session. Copying the frames of all sessions into each
  /// session's cell would take quadratic time.
  model::CellModel CellWithFrames(const std::string& id) const {
    model::CellModel own = bare_;
    const auto known = by_id_.find(id);
    const model::SessionFrames* session = known == by_id_.end() ? last_ : known->second;
    if (session != nullptr) own.sessions = {*session};
    return own;
  }

  /// @param cell  with the frames of one session, if it has sessions
  static std::vector<bool> TipsElsewhere(const model::CellModel& cell) {
    std::vector<bool> elsewhere;
    for (int tool = 0; tool < cell.tools(); ++tool) {
      elsewhere.push_back(!cell.sessions.empty() &&
                          !measure::StatesTip(cell, cell.sessions.front(), tool));
    }
    return elsewhere;
  }

  /// Of re-estimated frames, and of tips that the session did not measure.
  std::vector<measure::FrameCovariance> CovarianceOf(const std::string& id,
                                                     const std::vector<bool>& elsewhere) const {
    auto known = aligned_.find(id);
    if (known == aligned_.end() && last_ != nullptr) known = aligned_.find(last_->id);
    if (known != aligned_.end()) return known->second;
    std::vector<measure::FrameCovariance> own(elsewhere.size(), measure::FrameCovariance::Zero());
    for (std::size_t tool = 0; tool < elsewhere.size(); ++tool) {
      if (!elsewhere[tool]) continue;
      const double variance_m2 = measure::TipVarianceElsewhere(cell_, static_cast<int>(tool));
      own[tool].diagonal().tail<3>().setConstant(variance_m2);
    }
    return own;
  }

  const model::CellModel& cell_;
  model::CellModel bare_;  ///< without sessions
  const model::DeclaredDeviation& deviation_;
  const measure::FrameCovariances& aligned_;
  std::map<std::string, const model::SessionFrames*> by_id_;
  const model::SessionFrames* last_ = nullptr;
  std::map<std::string, SessionArm> arms_;
};

/// Load of a row, with what the row and the cell state of it.
/// @param payload_kg  total mass that the row carries
deflection::LoadStatement LoadOfRow(const model::CellModel& cell, const measure::MeasuredRow& row,
                                    double payload_kg) {
  deflection::LoadStatement load;
  // The declared centre of gravity also applies to a payload of unknown mass.
  load.modelled = loads::LoadOf(cell, row.payload_kg, row.tool_number, row.payload_item);
  const bool item = loads::ItemOf(cell, row.payload_item) != nullptr;
  // An item alone is the whole load only if the cell declares no payload beside it.
  if (row.payload_kg || (item && !cell.payload_cog_F)) load.mass_kg = payload_kg;
  load.centre_stated = cell.payload_cog_F.has_value() || item;
  return load;
}

Result<Prediction> PredictRow(SessionArm& session, const measure::MeasuredTable& poses,
                              const measure::MeasuredRow& row, const effects::Conditions& moment,
                              const deflection::LoadStatement& load) {
  deflection::LoadedState state;
  if (!session.arm.AtCommanded(row.q, load.modelled, moment, state)) {
    return Error{
        fmt::format("{}:{}: the deflection does not converge; check "
                    "payload_kg ({:g}) of the row, compliance_rad_per_Nm and link_mass_kg",
                    poses.file, row.line, load.modelled.mass_kg)};
  }
  const deflection::OperatingPoint point = session.arm.PointAt(row.q, load.modelled, moment);
  const int tool = load.modelled.tool;
  const bool extrapolated = session.tip_elsewhere[tool] || session.arm.growth().Outside(point) ||
                            session.arm.LacksColumn(moment) ||
                            PayloadNotRecorded(session.cell, poses) ||
                            EventStateUnknown(session.arm, moment);
  model::StatedRadius radius =
      session.uncertainty.At(session.arm, row.q, load, moment, extrapolated);
  if (radius.known()) {
    radius.radius_m = std::hypot(radius.radius_m,
                                 FrameRadius(session.frames[tool], session.cell.robot.X_WB, state));
  }
  const Vec3 moved_W = MovedByFading(session.cell, tool, session.arm.growth().Share(point), state);
  return Prediction{.p_WT = state.p_read_W + moved_W,
                    .radius = radius,
                    .extrapolated = extrapolated,
                    .exits = extrapolated ? session.arm.growth().Exits(point)
                                          : std::vector<deflection::DomainExit>(),
                    .tip_elsewhere = session.tip_elsewhere[tool],
                    .rests_on_growth =
                        extrapolated && session.uncertainty.RestsOnGrowth(session.arm, load, point),
                    .beyond_linear = config::BeyondLinearTheory(session.cell, session.arm, state)};
}

}  // namespace

bool PayloadNotRecorded(const model::CellModel& cell, const measure::MeasuredTable& poses) {
  const bool fitted_without = cell.domain && !cell.domain->payload_kg;
  return cell.payload_cog_F && !poses.recorded.payload && !fitted_without;
}

Result<std::vector<Prediction>> Predict(const model::CellModel& cell,
                                        const measure::MeasuredTable& poses,
                                        const model::DeclaredDeviation& deviation,
                                        const measure::FrameCovariances& frames,
                                        const std::function<void(std::size_t)>& done) {
  constexpr std::size_t kRowsAtOnce = 64;
  SessionArms arms(cell, deviation, frames);
  std::vector<Prediction> predictions;
  const std::vector<effects::Conditions> conditions = ConditionsOf(cell, poses);
  for (std::size_t k = 0; k < poses.rows.size(); ++k) {
    if (done && k % kRowsAtOnce == 0) done(k);
    const measure::MeasuredRow& row = poses.rows[k];
    SessionArm& session = arms.Of(row.session);
    if (session.arm.torques_missing(poses.recorded.tau)) {
      return Error{
          "joints have a compliance, but their gravity torques are unknown; give link_mass_kg for "
          "every link, or remove compliance_rad_per_Nm"};
    }
    const Result<Prediction> prediction = PredictRow(
        session, poses, row, conditions[k], LoadOfRow(cell, row, conditions[k].payload_kg));
    if (!prediction) return Error{prediction.error()};
    predictions.push_back(*prediction);
  }
  return predictions;
}

}  // namespace plumbline::cli
