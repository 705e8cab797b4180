#include <opencv2/imgcodecs.hpp>
#include <string_view>
#include <type_traits>

#include "drivers/camera/image_codecs.h"

/// The only function of the module, see plumbline::ReadGreyImage. Does not throw.
extern "C" __attribute__((visibility("default"))) const char* plumbline_read_grey_image_1(
    const char* path, plumbline::camera::TakeGreyImage* take, void* image) {
  cv::Mat grey;
  try {
    grey = cv::imread(path, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    return "not a readable image, or larger than 100 megapixels";
  }
  if (grey.empty()) return "not a readable image: damaged, or of an unknown format";
  if (!grey.isContinuous()) grey = grey.clone();
  take(image, grey.cols, grey.rows, grey.ptr());
  return nullptr;
}

// The programs look this function up by name.
static_assert(std::string_view(plumbline::camera::kReadGreyImageName) ==
              "plumbline_read_grey_image_1");
static_assert(
    std::is_same_v<decltype(plumbline_read_grey_image_1), plumbline::camera::ReadGreyImage>);
