// Status of cell and daemon as JSON (/status.json), for the page and other programs.
#pragma once

#include <string>
#include <vector>

#include "app/display/page/log_tail.h"
#include "app/display/view/display_mailbox.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::display {

/// Picture and server as reported by the page.
struct PictureFacts {
  image::ImageSize size{0, 0};  ///< 0 if no picture was drawn
  double age_s = 0;
  std::string server_start;  ///< unique for each start; a change means that streams have ended
};

/// Incremented with every change that an older reader would misinterpret.
inline constexpr int kStatusSchema = 1;

/// @return  one JSON object: headline and panels as on the display ("tone": plain, good, attention,
///          bad, faded), and the values behind them in SI units; unknown values are null
/// @param now    null if there is no status yet
/// @param now_s  monotonic
std::string StatusJson(const display::DisplayStatus* now, const PictureFacts& picture,
                       const std::vector<RecentLogEntry>& log, double now_s);

}  // namespace plumbline::display
