// Zoom sensor that replays recorded readings, to run the supervision without a lens.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/zoom/zoom_kind.h"
#include "firmware-like/result.h"

namespace plumbline::zoom {

struct ZoomRow {
  double t_s = 0;             ///< time since the start of the recording
  lens::ZoomReading reading;  ///< its time_s is unused
  bool lost = false;          ///< the sensor did not answer
};

/// Parses a table with the columns t_s (ascending) and zoom_counts and optionally focus_counts,
/// moving, digital_zoom, moved, lost (0 or 1), in any order; an empty field means "not reported".
/// Pure. @return the rows, or the first fault with its line
Result<std::vector<ZoomRow>> ZoomRowsFromCsv(std::string_view csv);

/// The first Read() returns the first row; each row lasts until the time of the next one, the last
/// row for ever. A `moved` flag in rows that were skipped is reported by the next Read().
class ReplayZoom : public ZoomSensor {
 public:
  /// Fails without rows or if the times do not ascend.
  static Result<std::unique_ptr<ZoomSensor>> Create(std::vector<ZoomRow> rows, Clock clock);

  ZoomResult Read(lens::ZoomReading& reading) override;
  std::string_view problem() const override { return problem_; }

 private:
  ReplayZoom(std::vector<ZoomRow> rows, Clock clock) : rows_(std::move(rows)), clock_(clock) {}

  std::vector<ZoomRow> rows_;
  Clock clock_;
  std::optional<double> start_s_;
  std::size_t shown_ = 0;  ///< rows that have become due
  std::string_view problem_;
};

/// Zoom kind "replay".
extern const ZoomKind kReplayZoomKind;

}  // namespace plumbline::zoom
