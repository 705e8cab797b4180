// Tiles of the assembly points: name, correction, radius with its basis, and notes.
#pragma once

#include <string>
#include <vector>

#include "app/display/view/picture_writer.h"

namespace plumbline::display {

struct PointTile {
  int id = 0;
  std::string name;
  StateClass state = StateClass::kHealthy;
  std::string value;   ///< "12.77 mm", or "not valid"
  std::string radius;  ///< "±1.25 mm (95 %, assumed)", or why the point is not valid
  std::string note;    ///< drift, and what limits the use of the point; or what to do

  bool valid() const { return state != StateClass::kAlarm; }
};

/// Configured name of a point, or "point 3".
std::string PointName(const ViewFacts& facts, int id);

/// The drift statistic, which raises an alarm at 1: "0.26 of threshold", "1.8 × threshold".
std::string DriftRatioText(double statistic);

/// One tile for each point, in configured order. @param facts  must contain a state
std::vector<PointTile> TilesOf(const ViewFacts& facts);

/// Adds the tiles that fit the layout's area; if there are more, the pages change every
/// kTilePage_s, and the page's number and the number of invalid points are shown.
inline constexpr double kTilePage_s = 6;
void AddPointTiles(const ViewFacts& facts, PictureWriter& writer);

}  // namespace plumbline::display
