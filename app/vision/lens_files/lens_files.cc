#include "app/vision/lens_files/lens_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/config/xml_document.h"
#include "app/base/text/yaml_scalars.h"
#include "app/vision/lens_files/artoolkit_file.h"
#include "app/vision/lens_files/opencv_file.h"
#include "firmware-like/result.h"

namespace plumbline::vision {
namespace {

// Numbers in a parameter file of cv::FileStorage, by name.

/// The numbers of each key of the top level, names in lower case: one number, or the elements of a
/// matrix row by row. Texts and anything else are left out.
using NamedNumbers = std::map<std::string, std::vector<double>>;

constexpr std::size_t kMostNumbers = 4096;

std::string InLowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return text;
}

/// Finite numbers separated by white space; nullopt if the text holds anything else.
std::optional<std::vector<double>> NumbersIn(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  std::vector<double> numbers;
  while (true) {
    const std::size_t first = text.find_first_not_of(kBlanks);
    if (first == std::string_view::npos) return numbers;
    text.remove_prefix(first);
    const std::string_view word = text.substr(0, text.find_first_of(kBlanks));
    text.remove_prefix(word.size());
    double number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    const bool whole = error == std::errc() && end == word.data() + word.size();
    if (!whole || !std::isfinite(number) || numbers.size() == kMostNumbers) return std::nullopt;
    numbers.push_back(number);
  }
}

/// @return  the numbers, or the reason with its line
Result<NamedNumbers> NumbersOfOpenCvXml(std::string_view text) {
  config::FaultList faults;
  const config::XmlDocument document(text, "", faults);
  if (!document.parsed()) {
    const config::Fault& fault = faults.All().front();
    return Error{"line " + std::to_string(fault.line) + ": " + fault.what};
  }
  NamedNumbers values;
  for (const pugi::xml_node& node : document.root().children()) {
    const pugi::xml_node data = node.child("data");
    auto numbers = NumbersIn((data ? data : node).child_value());
    if (numbers) values[InLowerCase(node.name())] = std::move(*numbers);
  }
  return values;
}

/// YAML 1.0 as written by OpenCV, with its header that YAML 1.2 does not know, or plain YAML.
Result<NamedNumbers> NumbersOfOpenCvYaml(std::string_view text) {
  // OpenCV writes "%YAML:1.0", which is no directive of YAML: the line is blanked, so that later
  // lines keep their numbers.
  std::string plain(text);
  if (plain.starts_with("%YAML:")) {
    std::fill_n(plain.begin(), std::min(plain.find('\n'), plain.size()), ' ');
  }
  const auto scalars = text::ScalarsFromYaml(plain);
  if (!scalars) return scalars.failure();
  NamedNumbers values;
  for (const text::YamlScalar& scalar : *scalars) {
    const auto number = NumbersIn(scalar.value);
    if (!number || number->size() != 1) continue;
    const std::string& path = scalar.path;
    const std::size_t data = path.find(".data[");
    if (data == std::string::npos && path.find_first_of(".[") != std::string::npos) continue;
    std::vector<double>& of_key = values[InLowerCase(path.substr(0, data))];
    if (of_key.size() < kMostNumbers) of_key.push_back(number->front());
  }
  return values;
}

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

Result<void> ReadDistortion(const NamedNumbers& values, bool fisheye, lens::Lens& lens) {
  const auto found = values.find("distortion_coefficients");
  const auto refused = [] {
    return Error{
        "\"distortion_coefficients\" are not k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4]]], or k1..k4 "
        "of a fisheye; calibrate the camera again, with a model of OpenCV without tilt or with "
        "plumbline calibrate-lens"};
  };
  if (found == values.end()) return refused();
  std::vector<double> terms = found->second;
  if (!fisheye) {
    // Absent terms are zero, and zero terms beyond those of a model mean nothing.
    constexpr std::size_t kSizes[] = {5, 8, 12};
    constexpr std::size_t kLeast = 4;
    if (terms.size() < kLeast) return refused();
    while (terms.size() > kSizes[0] && terms.back() == 0) terms.pop_back();
    for (const std::size_t size : kSizes) {
      if (terms.size() <= size) {
        terms.resize(size, 0.0);
        break;
      }
    }
  }
  if (!lens::SetDistortion(terms, fisheye, lens)) return refused();
  return {};
}

/// The covariance of all parameters, or of the usual ones alone.
Result<void> ReadCovariance(const NamedNumbers& values, lens::LensCovariance& covariance) {
  if (!values.contains("parameter_covariance")) return {};
  for (const int size : {lens::kUsualParameters, lens::kLensParameters}) {
    const auto* const numbers =
        Find(values, "parameter_covariance", static_cast<std::size_t>(size) * size);
    if (numbers == nullptr) continue;
    using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    covariance.topLeftCorner(size, size) = Eigen::Map<const Matrix>(numbers->data(), size, size);
    if ((covariance.diagonal().array() >= 0).all() &&
        covariance.isApprox(covariance.transpose(), 1e-6)) {
      return {};
    }
  }
  return Error{
      "\"parameter_covariance\" is not a symmetric matrix of 9 x 9 or 16 x 16 numbers; remove it"};
}

/// The circle in which the lens is trusted.
Result<void> ReadUsableRegion(const NamedNumbers& values, lens::KnownLens& lens) {
  if (!values.contains("usable_radius_px")) return {};
  const auto* const radius = Find(values, "usable_radius_px", 1);
  if (radius == nullptr || !(radius->front() > 0)) {
    return Error{"\"usable_radius_px\" is not a positive number; calibrate the camera again"};
  }
  lens.usable_radius_px = radius->front();
  return {};
}

/// Marks a fisheye of ROS, which is stated by a word.
/// @return  an error for a model that is not one of OpenCV's
Result<void> ReadRosModel(std::string_view yaml, NamedNumbers& values) {
  constexpr std::string_view kKey = "distortion_model:";
  const std::size_t at = yaml.find(kKey);
  if (at == std::string_view::npos) return {};
  std::string_view word = yaml.substr(at + kKey.size());
  word = word.substr(0, word.find_first_of("\r\n#"));
  const std::size_t first = word.find_first_not_of(" \t\"'");
  word = first == std::string_view::npos ? "" : word.substr(first);
  word = word.substr(0, word.find_first_of(" \t\"'"));
  if (word == "equidistant") {
    values["fisheye"] = {1};
  } else if (word != "plumb_bob" && word != "rational_polynomial") {
    return Error{
        fmt::format("distortion_model \"{}\" is not plumb_bob, rational_polynomial or equidistant; "
                    "calibrate the "
                    "camera with one of them, or with plumbline calibrate-lens",
                    word.substr(0, 40))};
  }
  return {};
}

Result<LensFile> LensFromNumbers(const NamedNumbers& values) {
  LensFile file;
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
  const auto is_set = [&values](const char* key) {
    const std::vector<double>* const flag = Find(values, key, 1);
    return flag != nullptr && flag->front() == 1;
  };
  // "fisheye_model" is written by OpenCV's calibration sample.
  const bool is_fisheye = is_set("fisheye") || is_set("fisheye_model");
  if (const auto read = ReadDistortion(values, is_fisheye, file.lens); !read) return read.failure();
  if (const auto read = ReadCovariance(values, file.covariance); !read) return read.failure();
  if (const auto read = ReadUsableRegion(values, file); !read) return read.failure();
  const std::vector<double>* const accepted = Find(values, "accepted", 1);
  file.accepted = accepted == nullptr || accepted->front() == 1;
  return file;
}

}  // namespace

Result<LensFile> LensFromFile(std::string_view bytes) {
  if (IsArToolKitFile(bytes)) {
    const Result<lens::KnownLens> read = LensFromArToolKit(bytes);
    if (!read) return read.failure();
    LensFile file;
    static_cast<lens::KnownLens&>(file) = *read;
    file.accepted = true;
    return file;
  }
  const std::size_t first = bytes.find_first_not_of(" \t\r\n");
  const char start = first == std::string_view::npos ? '{' : bytes[first];
  if (start == '{' || start == '[') return LensFromJson(bytes);
  Result<NamedNumbers> values =
      start == '<' ? NumbersOfOpenCvXml(bytes) : NumbersOfOpenCvYaml(bytes);
  if (!values) return values.failure();
  if (const auto model = ReadRosModel(bytes, values.value()); !model) return model.failure();
  return LensFromNumbers(*values);
}

Result<std::string> LensFileOf(const LensEntry& entry, const std::string& path) {
  const auto ends = [&path](std::string_view ending) { return path.ends_with(ending); };
  if (ends(".xml")) return OpenCvXml(entry);
  if (ends(".yaml") || ends(".yml")) return OpenCvYaml(entry);
  if (ends(".dat")) return ArToolKitBytes(entry);
  return Error{fmt::format("the extension selects the file format; use {}", kWrittenEndings)};
}

}  // namespace plumbline::vision
