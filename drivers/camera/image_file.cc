#include "drivers/camera/image_file.h"

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

namespace plumbline {

namespace fs = std::filesystem;

Result<GreyImage> ReadImage(const std::string& path) {
  std::error_code why;
  const std::uintmax_t bytes = fs::file_size(path, why);
  if (why) return Error{why.message()};
  if (bytes > std::uintmax_t{256} << 20) return Error{"larger than 256 MB"};
  cv::Mat image;
  try {
    image = cv::imread(path, cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) {
    return Error{"no image that can be read, or one of absurd size"};
  }
  if (image.empty()) return Error{"no image that can be read: broken, or of an unknown kind"};
  GreyImage grey;
  grey.width = image.cols;
  grey.height = image.rows;
  grey.grey.reserve(image.total());
  for (int v = 0; v < image.rows; ++v)
    grey.grey.insert(grey.grey.end(), image.ptr(v), image.ptr(v) + image.cols);
  return grey;
}

}  // namespace plumbline
