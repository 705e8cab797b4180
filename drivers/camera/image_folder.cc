#include "drivers/camera/image_folder.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

namespace plumbline {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kLargestFile = std::uintmax_t{256} << 20;
constexpr std::array kEndings = {".png",  ".jpg", ".jpeg", ".bmp", ".tif",
                                 ".tiff", ".pgm", ".ppm",  ".webp"};

bool IsImageName(const fs::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end();
}

/// By their text, runs of digits by their number.
bool NaturallyBefore(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  while (i < a.size() && j < b.size()) {
    if (digit(a[i]) && digit(b[j])) {
      std::size_t m = i, n = j;
      while (m < a.size() && digit(a[m])) ++m;
      while (n < b.size() && digit(b[n])) ++n;
      std::string x = a.substr(i, m - i), y = b.substr(j, n - j);
      x.erase(0, std::min(x.find_first_not_of('0'), x.size()));
      y.erase(0, std::min(y.find_first_not_of('0'), y.size()));
      if (x.size() != y.size()) return x.size() < y.size();
      if (x != y) return x < y;
      i = m;
      j = n;
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
    }
  }
  return a.size() - i < b.size() - j;
}

}  // namespace

Result<GreyImage> ReadImage(const std::string& path) {
  std::error_code why;
  const std::uintmax_t bytes = fs::file_size(path, why);
  if (why) return Error{why.message()};
  if (bytes > kLargestFile) return Error{"larger than 256 MB"};
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

Result<std::vector<std::string>> ImageNames(const std::string& folder) {
  std::error_code why;
  std::vector<std::string> names;
  fs::directory_iterator at(folder, why);
  for (; !why && at != fs::directory_iterator(); at.increment(why)) {
    std::error_code unknown;
    if (at->is_regular_file(unknown) && IsImageName(at->path()))
      names.push_back(at->path().filename().string());
  }
  if (why) return Error{why.message()};
  std::sort(names.begin(), names.end(), NaturallyBefore);
  return names;
}

}  // namespace plumbline
