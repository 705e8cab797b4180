#include "drivers/camera/image_file.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>

#include "drivers/camera/jpeg_image.h"
#include "drivers/files/open_failure.h"

namespace plumbline {

namespace fs = std::filesystem;
namespace {

/// OpenCV lets libjpeg print what is wrong with a file, and paints the rest grey.
Result<GreyImage> ReadJpeg(std::istream& file) {
  const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
  GreyImage image;
  if (auto why = DecodeJpegFile(bytes, image)) return *std::move(why);
  return image;
}

bool BeginsAsJpeg(std::istream& file) {
  const bool begins = file.get() == 0xFF && file.get() == 0xD8;
  file.clear();
  file.seekg(0);
  return begins;
}

}  // namespace

Result<GreyImage> ReadImage(const std::string& path) {
  std::error_code why;
  const std::uintmax_t bytes = fs::file_size(path, why);
  if (why) return Error{CannotBeRead(path, why.message())};
  if (bytes > std::uintmax_t{256} << 20) return Error{"larger than 256 MB"};
  std::ifstream file(path, std::ios::binary);
  if (BeginsAsJpeg(file)) return ReadJpeg(file);
  cv::Mat image;
  try {
    image = cv::imread(path, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
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
