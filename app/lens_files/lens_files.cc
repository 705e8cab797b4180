#include "app/lens_files/lens_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/lens_files/artoolkit_file.h"
#include "app/lens_files/opencv_values.h"
#include "app/lens_store/opencv_file.h"

namespace plumbline::lens_files {
namespace {

constexpr double kMostPixels = 65536;

/// The numbers of a key, if it has `count` of them.
const std::vector<double>* Find(const NamedNumbers& values, const char* key, std::size_t count) {
  const auto found = values.find(key);
  return found != values.end() && found->second.size() == count ? &found->second : nullptr;
}

Result<int> SideOf(const NamedNumbers& values, const char* key) {
  const std::vector<double>* const side = Find(values, key, 1);
  if (side == nullptr || side->front() != std::floor(side->front()) || side->front() < 1 ||
      side->front() > kMostPixels) {
    return Error{
        fmt::format("\"{}\" is not a number of pixels; add the size of the images that "
                    "the lens was calibrated with",
                    key)};
  }
  return static_cast<int>(side->front());
}

Result<void> ReadDistortion(const NamedNumbers& values, lens::Lens& lens) {
  constexpr std::size_t kLeast = 4, kUsed = 5;
  const auto found = values.find("distortion_coefficients");
  if (found == values.end() || found->second.size() < kLeast) {
    return Error{
        "\"distortion_coefficients\" are not k1 k2 p1 p2 [k3]; calibrate the camera again"};
  }
  std::vector<double> terms = found->second;
  terms.resize(std::max(terms.size(), kUsed), 0.0);
  if (std::any_of(terms.begin() + kUsed, terms.end(), [](double term) { return term != 0; })) {
    return Error{
        "\"distortion_coefficients\" has more terms than k1 k2 p1 p2 k3 (a rational or tilted "
        "model); calibrate without them, or with plumbline calibrate-lens"};
  }
  lens.k1 = terms[0];
  lens.k2 = terms[1];
  lens.p1 = terms[2];
  lens.p2 = terms[3];
  lens.k3 = terms[4];
  return {};
}

Result<void> ReadCovariance(const NamedNumbers& values, lens::LensCovariance& covariance) {
  constexpr int kSize = lens::kLensParameters;
  if (!values.contains("parameter_covariance")) return {};
  const auto* const numbers = Find(values, "parameter_covariance", kSize * kSize);
  if (numbers != nullptr) {
    covariance =
        Eigen::Map<const Eigen::Matrix<double, kSize, kSize, Eigen::RowMajor>>(numbers->data());
  }
  if (numbers == nullptr || !(covariance.diagonal().array() >= 0).all() ||
      !covariance.isApprox(covariance.transpose(), 1e-6)) {
    return Error{"\"parameter_covariance\" is not a symmetric matrix of 9 x 9 numbers; remove it"};
  }
  return {};
}

Result<lens::LensFile> LensFromNumbers(const NamedNumbers& values) {
  lens::LensFile file;
  const std::vector<double>* const camera = Find(values, "camera_matrix", 9);
  if (camera == nullptr) {
    return Error{
        "\"camera_matrix\" is not a matrix of 3 x 3 numbers; a lens file is written by plumbline "
        "calibrate-lens, by OpenCV's calibration sample, by ROS or by ARToolKit"};
  }
  const std::vector<double>& k = *camera;
  if (!(k[0] > 0) || !(k[4] > 0) || k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
    return Error{
        "\"camera_matrix\" is not [fx 0 cx; 0 fy cy; 0 0 1] with positive focal lengths; calibrate "
        "the camera again"};
  }
  file.lens.fx = k[0];
  file.lens.fy = k[4];
  file.lens.cx = k[2];
  file.lens.cy = k[5];
  const Result<int> width = SideOf(values, "image_width"), height = SideOf(values, "image_height");
  if (!width) return width.failure();
  if (!height) return height.failure();
  file.size = {*width, *height};
  if (const auto read = ReadDistortion(values, file.lens); !read) return read.failure();
  if (const auto read = ReadCovariance(values, file.covariance); !read) return read.failure();
  const std::vector<double>* const accepted = Find(values, "accepted", 1);
  file.accepted = accepted == nullptr || accepted->front() == 1;
  return file;
}

}  // namespace

Result<lens::LensFile> LensFromFile(std::string_view bytes) {
  if (IsArToolKitFile(bytes)) {
    const Result<lens::KnownLens> read = LensFromArToolKit(bytes);
    if (!read) return read.failure();
    lens::LensFile file;
    static_cast<lens::KnownLens&>(file) = *read;
    file.accepted = true;
    return file;
  }
  const std::size_t first = bytes.find_first_not_of(" \t\r\n");
  const char start = first == std::string_view::npos ? '{' : bytes[first];
  if (start == '{' || start == '[') return lens::LensFromJson(bytes);
  const Result<NamedNumbers> values =
      start == '<' ? NumbersOfOpenCvXml(bytes) : NumbersOfOpenCvYaml(bytes);
  if (!values) return values.failure();
  return LensFromNumbers(*values);
}

Result<std::string> LensFileOf(const lens_store::LensEntry& entry, const std::string& path) {
  const auto ends = [&path](std::string_view ending) { return path.ends_with(ending); };
  if (ends(".xml")) return lens_store::OpenCvXml(entry);
  if (ends(".yaml") || ends(".yml")) return lens_store::OpenCvYaml(entry);
  if (ends(".dat")) return ArToolKitBytes(entry);
  return Error{fmt::format("the ending names the form of the file; give {}", kWrittenEndings)};
}

}  // namespace plumbline::lens_files
