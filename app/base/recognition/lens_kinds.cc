// Lens files of other programs, boards and families of tags.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <map>

#include "app/base/recognition/kinds.h"
#include "app/base/recognition/lens_facts.h"

namespace plumbline::recognition {
namespace {

using Numbers = std::vector<double>;

constexpr std::size_t kMostParts = 64;  // cameras and matrices of a file that are read

std::optional<Stated<double>> StatedNumber(const Outline& file, const Entry* entry) {
  const auto number = NumberOf(file, entry);
  if (!number) return std::nullopt;
  return Stated<double>{*number, entry->line};
}

std::optional<Stated<double>> StatedNumber(const Outline& file, std::string_view name) {
  return StatedNumber(file, file.FindName(name));
}

std::optional<Stated<std::string>> StatedText(const Entry* entry) {
  if (entry == nullptr || entry->value.empty()) return std::nullopt;
  return Stated<std::string>{Quoted(entry->value), entry->line};
}

std::optional<Stated<Numbers>> StatedNumbers(const Outline& file, const Entry* entry) {
  if (entry == nullptr) return std::nullopt;
  Numbers numbers = NumbersOf(file, entry);
  if (numbers.empty()) return std::nullopt;
  return Stated<Numbers>{std::move(numbers), entry->line};
}

/// Numbers of terms that a distortion model has, by the names that programs give to it.
std::vector<std::size_t> TermsOfModel(std::string_view model) {
  static const std::map<std::string, std::vector<std::size_t>, std::less<>> kModels = {
      {"plumb_bob", {4, 5}},
      {"rational_polynomial", {8, 12, 14}},
      {"equidistant", {4}},
      {"fisheye", {4}},
      {"radtan", {4}},
      {"fov", {1}},
      {"kannala_brandt4", {4}},
      {"thin_prism_fisheye", {8}},
      {"lensmodel_pinhole", {0}},
      {"lensmodel_opencv4", {4}},
      {"lensmodel_opencv5", {5}},
      {"lensmodel_opencv8", {8}},
      {"lensmodel_opencv12", {12}},
      {"lensmodel_cahvor", {5}}};
  const auto found = kModels.find(InLowerCase(model));
  return found == kModels.end() ? std::vector<std::size_t>() : found->second;
}

/// Takes fx, fy, cx, cy and the skew from a 3 x 3 matrix, and checks its fixed elements.
void TakeMatrix(const Outline& file, const Entry* entry, LensFacts& lens, Recognition& found) {
  const Numbers k = NumbersOf(file, entry);
  if (entry == nullptr || k.empty()) return;
  if (k.size() != 9) {
    Contradict(found, "camera matrix", fmt::format("has {} numbers, not 3 x 3", k.size()),
               entry->line);
    return;
  }
  lens.fx = {k[0], entry->line};
  lens.fy = {k[4], entry->line};
  lens.cx = {k[2], entry->line};
  lens.cy = {k[5], entry->line};
  lens.skew = {k[1], entry->line};
  if (k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
    Contradict(found, "camera matrix",
               k[6] != 0 && k[2] == 0 ? "is transposed, as MATLAB writes it"
                                      : "is not [fx skew cx; 0 fy cy; 0 0 1]",
               entry->line);
  }
}

/// `rows` and `cols` beside `data` of every matrix.
void CheckMatrices(const Outline& file, Recognition& found) {
  std::size_t matrices = 0;
  std::string_view before;
  for (const Entry& data : file.entries()) {
    const bool further = data.path == before;  // of a block list
    before = data.path;
    if (further || !data.path.ends_with(".data") || ++matrices > kMostParts) continue;
    const std::string parent = data.path.substr(0, data.path.size() - 4);
    const auto rows = NumberOf(file, file.Find(parent + "rows"));
    const Entry* const cols_entry = file.Find(parent + "cols");
    const auto cols = NumberOf(file, cols_entry);
    const std::size_t count = NumbersOf(file, &data).size();
    if (!rows || !cols || count == 0 || *rows * *cols == static_cast<double>(count)) continue;
    const std::string matrix = parent.substr(0, parent.size() - 1);
    Contradict(found, Quoted(matrix.substr(matrix.rfind('.') + 1)),
               fmt::format("{:g} rows x {:g} cols (line {}), but data has {} numbers", *rows, *cols,
                           cols_entry->line, count),
               data.line);
  }
}

/// Parts of the sensor that the images are of.
void CheckPart(const Outline& file, Recognition& found) {
  for (const char* const name : {"binning_x", "binning_y"}) {
    const Entry* const entry = file.FindName(name);
    const auto number = NumberOf(file, entry);
    if (!number || *number <= 1) continue;
    Contradict(found, "binning",
               fmt::format("{} is {:g}: the numbers are for the whole sensor, the images are "
                           "smaller; calibrate without binning",
                           name, *number),
               entry->line);
  }
  for (const char* const name : {"roi.width", "roi.height", "roi.x_offset", "roi.y_offset"}) {
    const Entry* const entry = file.FindName(name);
    const auto number = NumberOf(file, entry);
    if (!number || *number == 0) continue;
    const bool whole = std::string_view(name).ends_with("th")
                           ? number == NumberOf(file, file.FindName("image_width")) ||
                                 number == NumberOf(file, file.Find("width"))
                           : std::string_view(name).ends_with("height") &&
                                 (number == NumberOf(file, file.FindName("image_height")) ||
                                  number == NumberOf(file, file.Find("height")));
    if (whole) continue;
    Contradict(found, "region",
               fmt::format("{} is {:g}: the images are a part of the sensor; the numbers are for "
                           "the whole one",
                           name, *number),
               entry->line);
    return;
  }
}

// OpenCV and the camera_info file of ROS.

const Entry* MatrixOf(const Outline& file, std::string_view name) {
  const Entry* const data = file.FindName(std::string(name) + ".data");
  return data != nullptr ? data : file.FindName(name);
}

bool IsOpenCv(const Outline& file) {
  if (file.syntax() == Syntax::kXml) return file.Find("opencv_storage") != nullptr;
  return file.FindLine("%YAML:") != nullptr ||
         (file.syntax() == Syntax::kYaml &&
          file.text().find("!!opencv-matrix") != std::string::npos);
}

void ReadCameraMatrix(const Outline& file, Recognition& found) {
  LensFacts lens;
  lens.width = StatedNumber(file, "image_width");
  lens.height = StatedNumber(file, "image_height");
  TakeMatrix(file, MatrixOf(file, "camera_matrix"), lens, found);
  lens.terms = StatedNumbers(file, MatrixOf(file, "distortion_coefficients"));
  lens.model = StatedText(file.FindName("distortion_model"));
  const auto is_set = [&file](const char* name) {
    return NumberOf(file, file.FindName(name)) == 1.0;
  };
  lens.fisheye = is_set("fisheye") || is_set("fisheye_model") ||
                 (lens.model && lens.model->value == "equidistant");
  lens.opencv_order = true;
  if (lens.model) {
    lens.model_terms = TermsOfModel(lens.model->value);
    if (lens.model_terms.empty()) {
      Contradict(found, "distortion model",
                 fmt::format("\"{}\" is not plumb_bob, rational_polynomial or equidistant",
                             lens.model->value),
                 lens.model->line);
    }
  } else {
    lens.model_terms =
        lens.fisheye ? std::vector<std::size_t>{4} : std::vector<std::size_t>{4, 5, 8, 12, 14};
  }
  AddLens(lens, found);
  AddValue(file, "camera_name", "camera", found);
  AddValue(file, "calibration_time", "calibrated", found);
  AddValue(file, "avg_reprojection_error", "reprojection error [px]", found);
  CheckMatrices(file, found);
  CheckPart(file, found);
}

/// Two cameras of OpenCV's stereo sample: M1, D1, M2, D2.
void ReadStereo(const Outline& file, Recognition& found) {
  LensFacts lens;
  TakeMatrix(file, MatrixOf(file, "M1"), lens, found);
  lens.terms = StatedNumbers(file, MatrixOf(file, "D1"));
  lens.model_terms = {4, 5, 8, 12, 14};
  AddLens(lens, found);
  CheckMatrices(file, found);
}

// The echo of a camera_info topic.

const Entry* EchoKey(const Outline& file, char letter) {
  const char small = static_cast<char>(std::tolower(letter));
  const Entry* const ros1 = file.Find(std::string(1, letter));
  return ros1 != nullptr ? ros1 : file.Find(std::string(1, small));
}

void ReadEcho(const Outline& file, Recognition& found) {
  LensFacts lens;
  lens.width = StatedNumber(file, file.Find("width"));
  lens.height = StatedNumber(file, file.Find("height"));
  TakeMatrix(file, EchoKey(file, 'K'), lens, found);
  lens.terms = StatedNumbers(file, EchoKey(file, 'D'));
  lens.model = StatedText(file.Find("distortion_model"));
  if (lens.model) lens.model_terms = TermsOfModel(lens.model->value);
  lens.fisheye = lens.model && lens.model->value == "equidistant";
  lens.opencv_order = true;
  const bool ros1 = file.Find("K") != nullptr;
  AddFact(found, "version", ros1 ? "ROS 1: K, D in capitals" : "ROS 2: k, d in small letters",
          EchoKey(file, 'K')->line);
  AddLens(lens, found);
  const std::size_t messages = file.Count(ros1 ? "K" : "distortion_model");
  if (messages > 1) AddFact(found, "messages", fmt::format("{}; the first is read", messages));
  CheckPart(file, found);
}

// Kalibr.

void ReadKalibr(const Outline& file, Recognition& found) {
  std::size_t cameras = 0;
  for (const Entry& entry : file.entries()) {
    if (!entry.path.starts_with("cam") || !entry.path.ends_with(".camera_model")) continue;
    if (++cameras > kMostParts) continue;
    const std::string camera = entry.path.substr(0, entry.path.find('.') + 1);
    AddFact(found, camera.substr(0, camera.size() - 1), Quoted(entry.value), entry.line);
    LensFacts lens;
    const Numbers size = NumbersOf(file, file.Find(camera + "resolution"));
    const Entry* const intrinsics_entry = file.Find(camera + "intrinsics");
    const Numbers intrinsics = NumbersOf(file, intrinsics_entry);
    if (size.size() == 2) {
      const int line = file.Find(camera + "resolution")->line;
      lens.width = {size[0], line};
      lens.height = {size[1], line};
    }
    const std::size_t expected = entry.value == "pinhole" ? 4
                                 : entry.value == "omni"  ? 5
                                 : entry.value == "ds"    ? 6
                                 : entry.value == "eucm"  ? 6
                                                          : 0;
    if (expected > 0 && intrinsics_entry != nullptr && intrinsics.size() != expected) {
      Contradict(found, "intrinsics",
                 fmt::format("{} numbers, but {} (line {}) has {}", intrinsics.size(),
                             Quoted(entry.value), entry.line, expected),
                 intrinsics_entry->line);
    } else if (expected > 0 && intrinsics.size() == expected) {
      const std::size_t first = expected - 4;
      const int line = intrinsics_entry->line;
      lens.fx = {intrinsics[first], line};
      lens.fy = {intrinsics[first + 1], line};
      lens.cx = {intrinsics[first + 2], line};
      lens.cy = {intrinsics[first + 3], line};
    }
    lens.model = StatedText(file.Find(camera + "distortion_model"));
    lens.terms = StatedNumbers(file, file.Find(camera + "distortion_coeffs"));
    if (lens.model) lens.model_terms = TermsOfModel(lens.model->value);
    lens.fisheye = lens.model && lens.model->value == "equidistant";
    lens.opencv_order = entry.value == "pinhole" && lens.model && lens.model->value != "fov";
    AddLens(lens, found);
  }
  AddFact(found, "cameras", fmt::format("{}", cameras));
}

// mrcal.

void ReadMrcal(const Outline& file, Recognition& found) {
  LensFacts lens;
  lens.model = StatedText(file.FindName("lensmodel"));
  const Entry* const entry = file.FindName("intrinsics");
  const Numbers numbers = NumbersOf(file, entry);
  const Entry* const size_entry = file.FindName("imagersize");
  const Numbers size = NumbersOf(file, size_entry);
  if (size.size() == 2) {
    lens.width = {size[0], size_entry->line};
    lens.height = {size[1], size_entry->line};
  }
  if (lens.model) lens.model_terms = TermsOfModel(lens.model->value);
  if (numbers.size() >= 4) {
    lens.fx = {numbers[0], entry->line};
    lens.fy = {numbers[1], entry->line};
    lens.cx = {numbers[2], entry->line};
    lens.cy = {numbers[3], entry->line};
    lens.terms = {Numbers(numbers.begin() + 4, numbers.end()), entry->line};
  }
  lens.opencv_order = lens.model && StartsWith(lens.model->value, "LENSMODEL_OPENCV");
  AddLens(lens, found);
}

// COLMAP.

/// A camera line: number, model, width, height, parameters.
struct ColmapCamera {
  const Line* line = nullptr;
  std::string model;
  Numbers numbers;  ///< width, height, parameters
};

struct ColmapModel {
  std::string_view name;
  std::size_t parameters;
};
constexpr std::array kColmapModels = {ColmapModel{"SIMPLE_PINHOLE", 3},
                                      ColmapModel{"PINHOLE", 4},
                                      ColmapModel{"SIMPLE_RADIAL", 4},
                                      ColmapModel{"RADIAL", 5},
                                      ColmapModel{"OPENCV", 8},
                                      ColmapModel{"OPENCV_FISHEYE", 8},
                                      ColmapModel{"FULL_OPENCV", 12},
                                      ColmapModel{"FOV", 5},
                                      ColmapModel{"SIMPLE_RADIAL_FISHEYE", 4},
                                      ColmapModel{"RADIAL_FISHEYE", 5},
                                      ColmapModel{"THIN_PRISM_FISHEYE", 12}};

std::vector<std::string_view> Words(std::string_view text) {
  std::vector<std::string_view> words;
  constexpr std::size_t kMost = 64;
  while (words.size() < kMost) {
    text = Trimmed(text);
    if (text.empty()) break;
    const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
    words.push_back(text.substr(0, end));
    text.remove_prefix(end);
  }
  return words;
}

std::optional<double> WordNumber(std::string_view word) {
  double number = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return number;
}

std::vector<ColmapCamera> ColmapCameras(const Outline& file) {
  std::vector<ColmapCamera> cameras;
  if (file.syntax() == Syntax::kBinary || file.syntax() == Syntax::kXml) return cameras;
  for (const Line& line : file.head()) {
    if (line.text.front() == '#') continue;
    const auto words = Words(line.text);
    if (words.size() < 5 || !WordNumber(words[0]) ||
        std::ranges::find(kColmapModels, words[1], &ColmapModel::name) == kColmapModels.end()) {
      continue;
    }
    ColmapCamera camera{&line, std::string(words[1]), {}};
    for (std::size_t k = 2; k < words.size(); ++k) {
      const auto number = WordNumber(words[k]);
      if (!number) break;
      camera.numbers.push_back(*number);
    }
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

void ReadColmap(const Outline& file, Recognition& found) {
  const auto cameras = ColmapCameras(file);
  AddFact(found, "cameras", fmt::format("{}", cameras.size()));
  for (const ColmapCamera& camera : cameras) {
    const auto model = std::ranges::find(kColmapModels, camera.model, &ColmapModel::name);
    const int line = camera.line->number;
    AddFact(found, "camera model", camera.model, line);
    if (camera.numbers.size() < 2) continue;
    const std::size_t parameters = camera.numbers.size() - 2;
    if (parameters != model->parameters) {
      Contradict(found, "parameters",
                 fmt::format("{}, but {} has {}", parameters, camera.model, model->parameters),
                 line);
      continue;
    }
    const auto& n = camera.numbers;
    const bool one_focal = camera.model.starts_with("SIMPLE") || camera.model.starts_with("RADIAL");
    LensFacts lens;
    lens.width = {n[0], line};
    lens.height = {n[1], line};
    lens.fx = {n[2], line};
    lens.fy = {one_focal ? n[2] : n[3], line};
    const std::size_t centre = one_focal ? 3 : 4;
    lens.cx = {n[centre], line};
    lens.cy = {n[centre + 1], line};
    lens.terms = {Numbers(n.begin() + static_cast<std::ptrdiff_t>(centre) + 2, n.end()), line};
    lens.fisheye = camera.model == "OPENCV_FISHEYE";
    lens.opencv_order = camera.model.find("OPENCV") != std::string::npos;
    AddLens(lens, found);
  }
  AddFact(found, "pixel (0, 0)", "corner of the image, half a pixel before its centre (COLMAP)");
}

// RealSense.

const Line* RealSenseLine(const Outline& file) {
  const Line* const heading = file.FindLine("Intrinsic of \"");
  if (heading != nullptr && file.FindLine("PPX:") != nullptr) return heading;
  for (const Line& line : file.head()) {
    const bool printed = line.text.find("x") != std::string_view::npos &&
                         line.text.find("  p[") != std::string_view::npos &&
                         line.text.find("  f[") != std::string_view::npos;
    if (printed) return &line;
  }
  return nullptr;
}

void ReadRealSense(const Outline& file, Recognition& found) {
  for (const auto& [start, what] :
       {std::pair{"Width:", "width [px]"}, std::pair{"Height:", "height [px]"},
        std::pair{"Fx:", "fx [px]"}, std::pair{"Fy:", "fy [px]"}, std::pair{"PPX:", "cx [px]"},
        std::pair{"PPY:", "cy [px]"}, std::pair{"Distortion:", "distortion model"},
        std::pair{"Coeffs:", "distortion"}}) {
    const Line* const line = file.FindLine(start);
    if (line == nullptr) continue;
    AddFact(found, what, Quoted(line->text.substr(std::string_view(start).size())), line->number);
  }
  std::size_t streams = 0;
  for (const Line& line : file.head()) streams += StartsWith(line.text, "Intrinsic of \"") ? 1 : 0;
  if (streams > 1) AddFact(found, "streams", fmt::format("{}; the first is shown", streams));
  const Line* const model = file.FindLine("Distortion:");
  if (model != nullptr && model->text.find("Inverse") != std::string_view::npos) {
    Contradict(found, "distortion model",
               "Inverse Brown Conrady maps pixels to directions, OpenCV's the other way: the terms "
               "are not OpenCV's unless they are 0",
               model->number);
  }
}

// Boards and tags.

void ReadTarget(const Outline& file, Recognition& found) {
  for (const char* const name : {"tagCols", "tagRows", "tagSize", "tagSpacing", "targetCols",
                                 "targetRows", "rowSpacingMeters", "colSpacingMeters"}) {
    AddValue(file, name, name, found);
  }
  AddFact(found, "lengths", "in m; tagSpacing as a share of tagSize (Kalibr)");
  const Entry* const type = file.FindName("target_type");
  if (type != nullptr && type->value == "aprilgrid") {
    found.conversion =
        "A grid of tags is not a board that calibrate-lens finds: print one with `plumbline print "
        "board`.";
  }
}

constexpr const char* kWriteYaml =
    "Write the numbers into a YAML with image_width, image_height, camera_matrix (rows, cols, "
    "data) "
    "and distortion_coefficients, as OpenCV does, or calibrate with plumbline calibrate-lens.";

/// A family of tags in the text: tag36h11, DICT_APRILTAG_36h11.
const Line* FamilyLine(const Outline& file) {
  for (const Line& line : file.head()) {
    const std::string lower = InLowerCase(line.text);
    for (const char* const family : {"tag36h11", "tag25h9", "tag16h5", "tagstandard41h12",
                                     "tagstandard52h13", "tagcircle21h7", "dict_apriltag"}) {
      if (lower.find(family) != std::string::npos) return &line;
    }
  }
  return nullptr;
}

constexpr const char* kUseLens = "plumbline track --image IMAGE --intrinsics {} --tag-size-mm SIZE";

constexpr std::array kLensKinds = {
    Kind{"ros-camera-info", "a lens file of ROS (camera_info)", Content::kLens,
         [](const Outline& file) -> std::optional<Fact> {
           if (file.syntax() != Syntax::kYaml || MatrixOf(file, "camera_matrix") == nullptr) {
             return std::nullopt;
           }
           const Entry* const model = file.Find("distortion_model");
           return Shown(model != nullptr ? model : file.Find("projection_matrix"));
         },
         ReadCameraMatrix, kUseLens, ""},
    Kind{"opencv-lens", "a lens file of OpenCV (cv::FileStorage)", Content::kLens,
         [](const Outline& file) -> std::optional<Fact> {
           if (!IsOpenCv(file)) return std::nullopt;
           return Shown(file.FindName("camera_matrix"));
         },
         ReadCameraMatrix, kUseLens, ""},
    Kind{"opencv-stereo", "two cameras of OpenCV's stereo calibration", Content::kLensOfOthers,
         [](const Outline& file) -> std::optional<Fact> {
           if (!IsOpenCv(file) || file.FindName("D1") == nullptr) return std::nullopt;
           return Shown(file.FindName("M1"));
         },
         ReadStereo, "",
         "Write one camera into a file of its own: M1 as camera_matrix, D1 as "
         "distortion_coefficients, with image_width and image_height."},
    Kind{"plain-lens", "a lens file (camera_matrix in YAML)", Content::kLens,
         [](const Outline& file) -> std::optional<Fact> {
           const bool yaml = file.syntax() == Syntax::kYaml && file.Find("image_width") != nullptr;
           return yaml ? Shown(MatrixOf(file, "camera_matrix")) : std::nullopt;
         },
         ReadCameraMatrix, kUseLens, ""},
    Kind{"ros-ini-lens", "a lens file of ROS in its .ini form", Content::kLensOfOthers,
         [](const Outline& file) -> std::optional<Fact> {
           const Line* const matrix = file.FindLine("camera ");
           const bool complete = matrix != nullptr && Words(matrix->text).size() == 2 &&
                                 matrix->text.ends_with(" matrix") &&
                                 file.FindLine("distortion") != nullptr &&
                                 file.FindLine("projection") != nullptr;
           return complete ? Shown(matrix) : std::nullopt;
         },
         nullptr, "", "Convert it: rosrun camera_calibration_parsers convert {} camera.yaml"},
    Kind{"ros-camera-info-echo", "a message of a camera_info topic of ROS (echo)",
         Content::kLensOfOthers,
         [](const Outline& file) -> std::optional<Fact> {
           const bool yaml = file.syntax() == Syntax::kYaml;
           const Entry* const k = yaml ? EchoKey(file, 'K') : nullptr;
           const bool complete = k != nullptr && EchoKey(file, 'D') != nullptr &&
                                 file.Find("distortion_model") != nullptr;
           return complete ? Shown(file.Find("distortion_model")) : std::nullopt;
         },
         ReadEcho, "",
         "Write it as a lens file: K as camera_matrix (rows: 3, cols: 3, data), D as "
         "distortion_coefficients (rows: 1, cols, data), width and height as image_width and "
         "image_height, and distortion_model."},
    Kind{"kalibr-camchain", "cameras calibrated by Kalibr (camchain)", Content::kLensOfOthers,
         [](const Outline& file) -> std::optional<Fact> {
           for (const Entry& entry : file.entries()) {
             const bool camera =
                 entry.path.starts_with("cam") && entry.path.ends_with(".camera_model");
             if (camera && file.syntax() == Syntax::kYaml) return Shown(&entry);
           }
           return std::nullopt;
         },
         ReadKalibr, "", kWriteYaml},
    Kind{"mrcal-cameramodel", "a camera model of mrcal (.cameramodel)", Content::kLensOfOthers,
         [](const Outline& file) -> std::optional<Fact> {
           const Entry* const model = file.FindName("lensmodel");
           const bool lens = model != nullptr && StartsWith(model->value, "LENSMODEL_");
           return lens ? Shown(model) : std::nullopt;
         },
         ReadMrcal, "", kWriteYaml},
    Kind{"colmap-cameras", "cameras of COLMAP (cameras.txt)", Content::kLensOfOthers,
         [](const Outline& file) -> std::optional<Fact> {
           const auto cameras = ColmapCameras(file);
           return cameras.empty() ? std::nullopt : Shown(cameras.front().line);
         },
         ReadColmap, "", kWriteYaml},
    Kind{"realsense-intrinsics", "intrinsics printed by a RealSense camera", Content::kLensOfOthers,
         [](const Outline& file) { return Shown(RealSenseLine(file)); }, ReadRealSense, "",
         kWriteYaml},
    Kind{"camera-settings", "settings of a GenICam camera (Basler .pfs, Hikrobot .mfs)",
         Content::kLensOfOthers,
         [](const Outline& file) { return Shown(file.FindLine("# GenApi persistence file")); },
         [](const Outline& file, Recognition& found) {
           for (const char* const name : {"# Device = ", "Width\t", "Height\t",
                                          "BinningHorizontal\t", "OffsetX\t", "OffsetY\t"}) {
             const std::string_view start = name;
             const Line* const line = file.FindLine(start);
             if (line == nullptr) continue;
             AddFact(found, Quoted(start.substr(0, start.find_first_of("\t="))),
                     Quoted(line->text.substr(start.size())), line->number);
           }
         },
         "",
         "It holds no lens: calibrate the camera with these settings, with plumbline "
         "calibrate-lens."},
    Kind{"agisoft-calibration", "a camera calibration of Metashape (Agisoft)",
         Content::kLensOfOthers,
         [](const Outline& file) { return Shown(file.Find("calibration.projection")); },
         [](const Outline& file, Recognition& found) {
           for (const char* const name : {"width", "height", "f", "cx", "cy", "k1", "k2", "k3"}) {
             AddValue(file, std::string("calibration.") + name, name, found);
           }
           AddFact(found, "principal point", "cx, cy from the middle of the image (Metashape)");
         },
         "", kWriteYaml},
    Kind{"matlab-lens", "a lens of the MATLAB calibration toolbox (Calib_Results.m)",
         Content::kLensOfOthers,
         [](const Outline& file) -> std::optional<Fact> {
           const Line* const focal = file.FindLine("fc = [");
           return focal != nullptr && file.FindLine("cc = [") != nullptr ? Shown(focal)
                                                                         : std::nullopt;
         },
         [](const Outline& file, Recognition& found) {
           for (const char* const name :
                {"fc = ", "cc = ", "alpha_c = ", "kc = ", "nx = ", "ny = "}) {
             const Line* const line = file.FindLine(name);
             if (line != nullptr) {
               AddFact(found, std::string(name).substr(0, std::string_view(name).find(' ')),
                       Quoted(line->text.substr(std::string_view(name).size())), line->number);
             }
           }
           AddFact(found, "distortion", "kc is k1 k2 p1 p2 k3, as in OpenCV");
         },
         "", kWriteYaml},
    Kind{"intrinsics-yaml", "intrinsics in YAML or JSON (fx, fy, cx, cy)", Content::kLensOfOthers,
         [](const Outline& file) -> std::optional<Fact> {
           const bool keys = file.syntax() == Syntax::kYaml || file.syntax() == Syntax::kBraces;
           const Entry* const fx = keys ? file.FindName("fx") : nullptr;
           const bool more = fx != nullptr && file.FindName("fy") != nullptr &&
                             (file.FindName("cx") != nullptr || file.FindName("ppx") != nullptr);
           const bool own = file.Find("image_size") != nullptr && file.Find("fx") != nullptr;
           return more && !own ? Shown(fx) : std::nullopt;
         },
         [](const Outline& file, Recognition& found) {
           LensFacts lens;
           lens.width = StatedNumber(file, "width");
           lens.height = StatedNumber(file, "height");
           lens.fx = StatedNumber(file, "fx");
           lens.fy = StatedNumber(file, "fy");
           lens.cx = StatedNumber(file, file.FindName("cx") != nullptr ? "cx" : "ppx");
           lens.cy = StatedNumber(file, file.FindName("cy") != nullptr ? "cy" : "ppy");
           AddLens(lens, found);
         },
         "", kWriteYaml},
    Kind{"json-camera-matrix", "a camera matrix in JSON", Content::kLensOfOthers,
         [](const Outline& file) -> std::optional<Fact> {
           if (file.syntax() != Syntax::kBraces) return std::nullopt;
           const Entry* const matrix = file.FindName("camera_matrix");
           return Shown(matrix != nullptr ? matrix : file.FindName("intrinsic_matrix"));
         },
         [](const Outline& file, Recognition& found) {
           LensFacts lens;
           const Entry* const plain = file.FindName("camera_matrix");
           const bool transposed = plain == nullptr;  // Open3D writes columns
           if (!transposed) TakeMatrix(file, plain, lens, found);
           if (transposed) AddFact(found, "order", "column by column (Open3D)");
           lens.width = StatedNumber(file, "width");
           lens.height = StatedNumber(file, "height");
           for (const char* const name :
                {"distortion_coefficients", "dist_coeffs", "dist_coeff", "dist", "distortion"}) {
             if (!lens.terms) lens.terms = StatedNumbers(file, file.FindName(name));
           }
           AddLens(lens, found);
         },
         "", kWriteYaml},
    Kind{"opencv-storage", "data of OpenCV (cv::FileStorage), no lens", Content::kBoard,
         [](const Outline& file) -> std::optional<Fact> {
           const bool xml = file.syntax() == Syntax::kXml;
           if (xml) return Shown(file.Find("opencv_storage"));
           return Shown(file.FindLine("%YAML:"));
         },
         nullptr, "",
         "A lens file has camera_matrix, distortion_coefficients, image_width and "
         "image_height."},
    Kind{"kalibr-target", "a calibration target of Kalibr", Content::kBoard,
         [](const Outline& file) { return Shown(file.Find("target_type")); }, ReadTarget, "",
         "Give the board to calibrate-lens: plumbline calibrate-lens --images FOLDER --board "
         "COLSxROWS --square-mm SIZE"},
    Kind{"apriltag-ros", "tags of apriltag_ros", Content::kBoard,
         [](const Outline& file) -> std::optional<Fact> {
           if (file.syntax() != Syntax::kYaml) return std::nullopt;
           const Entry* entry = file.FindName("standalone_tags");
           if (entry == nullptr) entry = file.FindName("tag_bundles");
           if (entry == nullptr) entry = file.FindName("tag_family");
           if (entry == nullptr && file.FindName("ros__parameters.family") != nullptr) {
             entry = file.FindName("family");
           }
           return Shown(entry);
         },
         [](const Outline& file, Recognition& found) {
           AddValue(file, "family", "family", found);
           AddValue(file, "tag_family", "family", found);
           std::size_t tags = 0;
           for (const Entry& entry : file.entries()) {
             tags += entry.path.ends_with(".id") || entry.path.ends_with("_tags.id") ? 1 : 0;
           }
           if (tags > 0) AddFact(found, "tags", fmt::format("{}", tags));
           AddFact(found, "lengths", "in m (apriltag_ros)");
         },
         "",
         "Write a bodies.toml: [[body]] with name, size_mm and [[body.tag]] with id and xyz_mm; "
         "see config/bodies.toml."},
    Kind{"tag-family", "a family of AprilTags (source or list of codes)", Content::kBoard,
         [](const Outline& file) -> std::optional<Fact> {
           const Line* const line = FamilyLine(file);
           const bool code = file.extension() == "c" || file.extension() == "h" ||
                             file.extension() == "java" || file.name().starts_with("tag");
           return line != nullptr && code ? Shown(line) : std::nullopt;
         },
         nullptr, "", "Plumbline has the codes of the usual families: plumbline print tag --help"},
};

}  // namespace

std::span<const Kind> LensKinds() {
  return kLensKinds;
}

}  // namespace plumbline::recognition
