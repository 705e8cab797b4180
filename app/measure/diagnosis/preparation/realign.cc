#include "app/measure/diagnosis/preparation/realign.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline::measure {

namespace {

constexpr double kTip_m = 0.05;  // of FramePrior

/// The tips of a tool in all sessions that state it.
std::vector<Vec3> StatedTips(const model::CellModel& cell, int tool) {
  std::vector<Vec3> tips;
  for (const model::SessionFrames& session : cell.sessions) {
    for (const model::SessionTip& tip : session.tips) {
      if (tip.tool == deflection::SessionTipNumber(cell, tool)) tips.push_back(tip.p_F);
    }
  }
  return tips;
}

}  // namespace

bool StatesTip(const model::CellModel& cell, const model::SessionFrames& session, int tool) {
  return cell.measurement.tool_known ||
         std::ranges::any_of(session.tips, [&](const model::SessionTip& tip) {
           return tip.tool == deflection::SessionTipNumber(cell, tool);
         });
}

double TipVarianceElsewhere(const model::CellModel& cell, int tool) {
  if (StatedTips(cell, tool).empty()) return kTip_m * kTip_m;
  double squares = 0;
  int freedom = 0;
  for (int other = 0; other < cell.tools(); ++other) {
    const std::vector<Vec3> tips = StatedTips(cell, other);
    Vec3 mean = Vec3::Zero();
    for (const Vec3& tip : tips) mean += tip / static_cast<double>(tips.size());
    for (const Vec3& tip : tips) squares += (tip - mean).squaredNorm();
    freedom += 3 * std::max(0, static_cast<int>(tips.size()) - 1);
  }
  return freedom > 0 ? squares / freedom : 0;
}

Result<Realignment> Realign(const model::CellModel& cell, const MeasuredTable& measured,
                            int threads) {
  if (cell.measurement.frame_known && cell.measurement.tool_known) return Realignment{cell, {}, {}};
  // The search starts from the frames of the last session.
  model::CellModel start = deflection::CellOfSession(cell, "");
  start.sessions.clear();
  const Result<Dataset> data = DatasetFrom(start, measured);
  if (!data) return Error{data.error()};
  const Result<Alignment> alignment = AlignFrames(*data, Model::Declared(*data), threads);
  if (!alignment) return Error{alignment.error()};
  Realignment realigned{start, {}, {}};
  for (const SessionIndex session : data->sessions.indices()) {
    model::SessionFrames& frames = realigned.cell.sessions.emplace_back();
    frames.id = data->sessions[session];
    frames.X_WB = alignment->model.frames[session].X_WB;
    std::vector<FrameCovariance> covariance = alignment->covariance[session];
    for (int tool = 0; tool < cell.tools(); ++tool) {
      if (data->measured_tools[session][tool]) {
        const Pose& X_FT = alignment->model.frames[session].X_FT[tool];
        frames.tips.push_back({deflection::SessionTipNumber(cell, tool), X_FT.p, std::nullopt});
      } else if (!cell.measurement.tool_known) {
        covariance[tool].diagonal().tail<3>().setConstant(TipVarianceElsewhere(cell, tool));
      }
    }
    realigned.covariance[frames.id] = std::move(covariance);
    const auto warning = UndeterminedFramesText(*data, *alignment, session);
    if (!warning) continue;
    realigned.notes.push_back(frames.id.empty() ? *warning
                                                : "session " + frames.id + ": " + *warning);
  }
  return realigned;
}

}  // namespace plumbline::measure
