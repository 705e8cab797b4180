// Plays recorded zoom readings: the whole supervision on a laptop.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/zoom/zoom_kind.h"
#include "firmware-like/result.h"

namespace plumbline {

struct ZoomRow {
  double t_s = 0;       ///< since the beginning of the recording
  ZoomReading reading;  ///< its time means nothing
  bool lost = false;    ///< the sensor gave no answer
};

/// Rows of a table with the columns t_s (ascending) and zoom_counts, and if wanted focus_counts,
/// moving, digital_zoom, moved, lost (0 or 1), in any order; an empty field is not told. A pure
/// function. @return the rows, or the first fault with its line
Result<std::vector<ZoomRow>> ZoomRowsFromCsv(std::string_view csv);

/// The first Read() shows the first row; each stands until the time of the next one, the last one
/// for ever. What was `moved` in rows that no Read() saw is told by the next.
class ReplayZoom : public ZoomSensor {
 public:
  /// Refuses no rows, and times that do not ascend.
  static Result<std::unique_ptr<ZoomSensor>> Create(std::vector<ZoomRow> rows, Clock clock);

  ZoomResult Read(ZoomReading& reading) override;
  std::string_view problem() const override { return problem_; }

 private:
  ReplayZoom(std::vector<ZoomRow> rows, Clock clock) : rows_(std::move(rows)), clock_(clock) {}

  std::vector<ZoomRow> rows_;
  Clock clock_;
  std::optional<double> start_s_;
  std::size_t shown_ = 0;  ///< rows that were due at some Read()
  std::string_view problem_;
};

/// A recorded table.
extern const ZoomKind kReplayZoomKind;

}  // namespace plumbline
