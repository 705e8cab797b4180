#include "app/vision/lens_files/opencv_file.h"

#include <fmt/format.h>

#include "app/base/target/declared_facts.h"

namespace plumbline::vision {
namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Writes all values in order. @param form  the syntax: Yaml or Xml
template <typename Form>
std::string WriteAll(const LensEntry& entry, Form form) {
  const std::vector<double> coefficients = lens::DistortionOf(entry.lens);
  Matrix camera = Matrix::Identity(3, 3);
  const Matrix distortion = Eigen::Map<const Matrix>(
      coefficients.data(), static_cast<Eigen::Index>(coefficients.size()), 1);
  camera(0, 0) = entry.lens.fx;
  camera(1, 1) = entry.lens.fy;
  camera(0, 2) = entry.lens.cx;
  camera(1, 2) = entry.lens.cy;
  if (!entry.utc.empty()) form.Text("calibration_time", entry.utc);
  form.Number("image_width", entry.size.width);
  form.Number("image_height", entry.size.height);
  form.Put("camera_matrix", camera);
  form.Put("distortion_coefficients", distortion);
  form.Real("avg_reprojection_error", entry.rms_px);
  if (!entry.key.camera_serial.empty()) {
    form.Text("camera_serial", entry.key.camera_serial);
    form.Number("zoom_counts", entry.key.zoom_counts);
  }
  if (entry.key.focus_counts) form.Number("focus_counts", *entry.key.focus_counts);
  if (entry.lens.fisheye) form.Number("fisheye", 1);
  if (entry.declared != target::DeclaredFacts{}) form.Text("declared", TextOf(entry.declared));
  if (!UsableEverywhere(entry)) form.Real("usable_radius_px", entry.usable_radius_px);
  const Eigen::Index count = ModelOf(entry.lens) == lens::LensModel::kUsual ? lens::kUsualParameters
                                                                            : lens::kLensParameters;
  form.Put("parameter_covariance", entry.covariance.topLeftCorner(count, count));
  return form.Done();
}

/// Exact decimal representation, always recognizable as a real number.
std::string Digits(double value) {
  std::string text = fmt::format("{:.17g}", value);
  if (text.find_first_of(".e") == std::string::npos) text += ".";
  return text;
}

std::string Numbers(const Matrix& matrix, const char* separator) {
  std::string text;
  for (Eigen::Index i = 0; i < matrix.size(); ++i) {
    if (i > 0)
      text += i % 4 == 0 ? fmt::format("{}\n    ", separator) : fmt::format("{} ", separator);
    text += Digits(matrix.data()[i]);
  }
  return text;
}

class Yaml {
 public:
  void Text(const char* key, const std::string& text) {
    std::string quoted;
    for (const char c : text) {
      if (static_cast<unsigned char>(c) < 0x20) continue;
      if (c == '"' || c == '\\') quoted += '\\';
      quoted += c;
    }
    text_ += fmt::format("{}: \"{}\"\n", key, quoted);
  }
  void Number(const char* key, int value) { text_ += fmt::format("{}: {}\n", key, value); }
  void Real(const char* key, double value) { text_ += fmt::format("{}: {}\n", key, Digits(value)); }
  void Put(const char* key, const Matrix& matrix) {
    text_ += fmt::format("{}: !!opencv-matrix\n  rows: {}\n  cols: {}\n  dt: d\n  data: [ {} ]\n",
                         key, matrix.rows(), matrix.cols(), Numbers(matrix, ","));
  }
  std::string Done() const { return text_; }

 private:
  std::string text_ = "%YAML:1.0\n---\n";
};

class Xml {
 public:
  void Text(const char* key, const std::string& text) {
    std::string escaped;
    for (const char c : text) {
      if (static_cast<unsigned char>(c) < 0x20) continue;
      escaped += c == '&'   ? "&amp;"
                 : c == '<' ? "&lt;"
                 : c == '>' ? "&gt;"
                 : c == '"' ? "&quot;"
                            : std::string(1, c);
    }
    text_ += fmt::format("<{0}>\"{1}\"</{0}>\n", key, escaped);
  }
  void Number(const char* key, int value) { text_ += fmt::format("<{0}>{1}</{0}>\n", key, value); }
  void Real(const char* key, double value) {
    text_ += fmt::format("<{0}>{1}</{0}>\n", key, Digits(value));
  }
  void Put(const char* key, const Matrix& matrix) {
    text_ += fmt::format(
        "<{0} type_id=\"opencv-matrix\">\n  <rows>{1}</rows>\n  <cols>{2}</cols>\n  <dt>d</dt>\n"
        "  <data>\n    {3}</data></{0}>\n",
        key, matrix.rows(), matrix.cols(), Numbers(matrix, ""));
  }
  std::string Done() const { return text_ + "</opencv_storage>\n"; }

 private:
  std::string text_ = "<?xml version=\"1.0\"?>\n<opencv_storage>\n";
};

}  // namespace

std::string OpenCvYaml(const LensEntry& entry) {
  return WriteAll(entry, Yaml());
}

std::string OpenCvXml(const LensEntry& entry) {
  return WriteAll(entry, Xml());
}

}  // namespace plumbline::vision
