#include "app/diagnosis/realign.h"

namespace plumbline {

Result<Realignment> Realigned(const CellModel& cell, const MeasuredTable& measured, int threads) {
  if (cell.measurement.frame_known && cell.measurement.tool_known) return Realignment{cell, {}, {}};
  // The last session's frames are where the search starts.
  CellModel start = CellOfSession(cell, "");
  start.sessions.clear();
  const Result<Dataset> data = DatasetFrom(start, measured);
  if (!data) return Error{data.error()};
  const Result<Alignment> alignment = AlignedFrames(*data, Model::Declared(*data), threads);
  if (!alignment) return Error{alignment.error()};
  Realignment realigned{cell, {}, {}};
  realigned.cell.sessions.clear();
  for (int s = 0; s < data->sessions_count(); ++s) {
    const auto at = static_cast<std::size_t>(s);
    SessionFrames& frames = realigned.cell.sessions.emplace_back();
    frames.id = data->sessions[at];
    frames.X_WB = alignment->model.frames[at].X_WB;
    frames.tip_F = alignment->model.frames[at].tip_F;
    realigned.covariance[frames.id] = alignment->covariance[at];
    const auto held = WhatStaysDeclared(*data, *alignment, s);
    if (!held) continue;
    realigned.notes.push_back(frames.id.empty() ? *held : "session " + frames.id + ": " + *held);
  }
  return realigned;
}

}  // namespace plumbline
