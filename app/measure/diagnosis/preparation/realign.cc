#include "app/measure/diagnosis/preparation/realign.h"

#include "app/measure/diagnosis/preparation/dataset_preparation.h"

namespace plumbline::measure {

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
  Realignment realigned{cell, {}, {}};
  realigned.cell.sessions.clear();
  for (const SessionIndex session : data->sessions.indices()) {
    model::SessionFrames& frames = realigned.cell.sessions.emplace_back();
    frames.id = data->sessions[session];
    frames.X_WB = alignment->model.frames[session].X_WB;
    for (int tool = 0; tool < cell.tools(); ++tool) {
      if (!data->measured_tools[session][tool]) continue;
      const Pose& X_FT = alignment->model.frames[session].X_FT[tool];
      frames.tips.push_back({deflection::SessionTipNumber(cell, tool), X_FT.p, std::nullopt});
    }
    realigned.covariance[frames.id] = alignment->covariance[session];
    const auto warning = UndeterminedFramesText(*data, *alignment, session);
    if (!warning) continue;
    realigned.notes.push_back(frames.id.empty() ? *warning
                                                : "session " + frames.id + ": " + *warning);
  }
  return realigned;
}

}  // namespace plumbline::measure
