// /status.json: how things are, for the page and for programs.
#pragma once

#include <string>
#include <vector>

#include "app/page/log_tail.h"
#include "app/view/shown.h"

namespace plumbline {

/// The picture and the server as far as the page tells of them.
struct PictureFacts {
  ImageSize size{0, 0};  ///< 0: none was drawn
  double age_s = 0;
  std::string server_start;  ///< another one with every start: streams of a former one have ended
};

/// Raised with every change that an older reader would misunderstand.
inline constexpr int kStatusSchema = 1;

/// One JSON object: the headline and panels in the monitor's words ("tone": plain, good, attention,
/// bad, faded), and the numbers behind them, SI. What is not known is null.
/// @param now    null: nothing was put together yet
/// @param now_s  monotonic
std::string StatusJson(const ShownNow* now, const PictureFacts& picture,
                       const std::vector<TailLine>& log, double now_s);

}  // namespace plumbline
