#include "app/diagnosis/realign.h"

#include "app/diagnosis/alignment.h"

namespace plumbline {

Result<CellModel> Realigned(const CellModel& cell, const MeasuredTable& measured, int threads) {
  if (cell.measurement.frame_known && cell.measurement.tool_known) return cell;
  // The last session's frames are where the search starts.
  CellModel start = CellOfSession(cell, "");
  start.sessions.clear();
  const Result<Dataset> data = DatasetFrom(start, measured);
  if (!data) return Error{data.error()};
  const Result<Model> model = Aligned(*data, Model::Declared(*data), threads);
  if (!model) return Error{model.error()};
  CellModel realigned = cell;
  realigned.sessions.clear();
  for (int s = 0; s < data->sessions_count(); ++s) {
    const auto at = static_cast<std::size_t>(s);
    SessionFrames& frames = realigned.sessions.emplace_back();
    frames.id = data->sessions[at];
    frames.X_WB = model->frames[at].X_WB;
    frames.tip_F = model->frames[at].tip_F;
  }
  return realigned;
}

}  // namespace plumbline
