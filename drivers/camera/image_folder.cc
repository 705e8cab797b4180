#include "drivers/camera/image_folder.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>

namespace plumbline::camera {
namespace {

namespace fs = std::filesystem;

constexpr std::array kExtensions = {".png",  ".jpg", ".jpeg", ".bmp", ".tif",
                                    ".tiff", ".pgm", ".ppm",  ".webp"};

bool IsImageName(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
}

/// Natural order: runs of digits compare as numbers.
bool NaturalLess(const std::string& a, const std::string& b) {
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

Result<std::vector<std::string>> ListImageNames(const std::string& folder) {
  std::error_code why;
  std::vector<std::string> names;
  fs::directory_iterator at(folder, why);
  for (; !why && at != fs::directory_iterator(); at.increment(why)) {
    std::error_code unknown;
    if (at->is_regular_file(unknown) && IsImageName(at->path()))
      names.push_back(at->path().filename().string());
  }
  if (why) return Error{why.message()};
  std::sort(names.begin(), names.end(), NaturalLess);
  return names;
}

}  // namespace plumbline::camera
