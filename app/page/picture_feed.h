// The picture as JPEG, encoded once for everybody who looks.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "app/view/shown.h"

namespace plumbline {

struct JpegPicture {
  std::string bytes;
  std::uint64_t number = 0;  ///< counts up from 1
  double drawn_s = 0;        ///< monotonic
};

/// Baseline, chroma halved, with libjpeg. @return  empty: the picture is empty, or there is no room
std::string JpegOf(const RgbImage& image);

/// For several threads. The newest picture only: what nobody took is gone.
class PictureFeed {
 public:
  static constexpr double kPeriod_s = 0.1;  ///< from one picture to the next, for all viewers

  explicit PictureFeed(Shown& shown) : shown_(shown) {}

  /// Asks for pictures, and encodes the newest where nobody has yet. @return  null: none was drawn
  std::shared_ptr<const JpegPicture> Newest(double now_s);

 private:
  Shown& shown_;
  std::mutex mutex_;
  std::shared_ptr<const ShownPicture> encoded_;  ///< what `newest_` was made from
  double encoded_s_ = -1e300;
  std::shared_ptr<const JpegPicture> newest_;
};

}  // namespace plumbline
