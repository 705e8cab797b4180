#include <opencv2/imgcodecs.hpp>
#include <string_view>
#include <type_traits>

#include "drivers/camera/image_codecs.h"

/// The module's one function: see plumbline::ReadGreyImage. No exception of OpenCV's leaves it.
extern "C" __attribute__((visibility("default"))) const char* plumbline_read_grey_image_1(
    const char* path, plumbline::TakeGreyImage* take, void* image) {
  cv::Mat grey;
  try {
    grey = cv::imread(path, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    return "no image that can be read, or one of absurd size";
  }
  if (grey.empty()) return "no image that can be read: broken, or of an unknown kind";
  if (!grey.isContinuous()) grey = grey.clone();
  take(image, grey.cols, grey.rows, grey.ptr());
  return nullptr;
}

// The name that the programs look for is this function's.
static_assert(std::string_view(plumbline::kReadGreyImageName) == "plumbline_read_grey_image_1");
static_assert(std::is_same_v<decltype(plumbline_read_grey_image_1), plumbline::ReadGreyImage>);
