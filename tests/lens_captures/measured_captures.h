// Captures of real boards by real cameras, from the folder of recordings beside the checkout.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/base/target/board.h"
#include "app/vision/lens/board_detection.h"
#include "app/vision/lens/board_view.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::lens_captures {

/// Path of a recording: $PLUMBLINE_MEASURED/name, or ../shared/measured/name from the root of the
/// checkout. Empty if it is not available.
std::filesystem::path MeasuredFolder(const std::string& name);

struct MeasuredCapture {
  std::string name;
  target::Board board;
  image::ImageSize size;
  std::vector<vision::BoardView> views;
  std::vector<std::string> missed;  ///< images in which the board was not found
  std::vector<int> image_of;        ///< of each view: several views may come from one image
};

/// One of OpenCV's two sample cameras. @param camera  "left" or "right"
MeasuredCapture OpenCvSample(const std::string& camera);
/// Zhang's 8 x 8 separate squares: the squares' four corners form four boards of 8 x 8 points in
/// each image. The corners are his.
MeasuredCapture ZhangSquares();
/// A ChArUco board on a robot; the corners are OpenCV's, since not all images are at hand.
MeasuredCapture RobotCharuco();
/// Those that are available.
std::vector<MeasuredCapture> AllMeasuredCaptures();

}  // namespace plumbline::lens_captures
