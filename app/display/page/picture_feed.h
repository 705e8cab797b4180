// JPEG feed of the display's picture, encoded once for all viewers.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "app/display/view/display_mailbox.h"

namespace plumbline::display {

struct JpegPicture {
  std::string bytes;
  std::uint64_t number = 0;  ///< counted from 1
};

/// Encodes baseline JPEG with 2x2 chroma subsampling.
/// @return  empty if the picture is empty or memory is short
std::string JpegOf(const display::RgbImage& image);

/// Provides the newest picture only; pictures that no viewer took are dropped. Thread-safe.
class PictureFeed {
 public:
  static constexpr double kPeriod_s = 0.1;  ///< from one picture to the next, for all viewers

  explicit PictureFeed(display::DisplayMailbox& shown) : shown_(shown) {}

  /// Requests pictures, and encodes the newest one if that was not done yet.
  /// @return  null if none was drawn
  std::shared_ptr<const JpegPicture> Newest(double now_s);

 private:
  display::DisplayMailbox& shown_;
  std::mutex mutex_;
  std::shared_ptr<const display::DisplayPicture> encoded_;  ///< source of `newest_`
  double encoded_s_ = -1e300;
  std::shared_ptr<const JpegPicture> newest_;
};

}  // namespace plumbline::display
