#include "tests/lens_captures/measured_captures.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <utility>

#include "drivers/camera/image_file.h"

namespace plumbline::lens_captures {
namespace {

namespace fs = std::filesystem;

/// Lines of numbers.
std::vector<std::vector<double>> Numbers(const fs::path& path) {
  std::ifstream file(path);
  std::vector<std::vector<double>> lines;
  for (std::string line; std::getline(file, line);) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    std::vector<double> numbers;
    for (double number = 0; words >> number;) numbers.push_back(number);
    if (!numbers.empty()) lines.push_back(numbers);
  }
  return lines;
}

/// One of the four boards that the squares' corners form.
vision::BoardView ViewOfCorner(const std::vector<std::vector<double>>& model,
                               const std::vector<std::vector<double>>& data, std::size_t corner,
                               double pitch) {
  double left = 1e9, top = -1e9;  // Zhang's y points upwards
  for (const auto& square : model) {
    left = std::min(left, square[2 * corner]);
    top = std::max(top, square[2 * corner + 1]);
  }
  vision::BoardView view;
  view.corners_px.resize(64);
  view.seen.assign(64, true);
  for (std::size_t k = 0; k < 64; ++k) {
    const long column = std::lround((model[k][2 * corner] - left) / pitch);
    const long row = std::lround((top - model[k][2 * corner + 1]) / pitch);
    view.corners_px.at(static_cast<std::size_t>(row * 8 + column)) = {data[k][2 * corner],
                                                                      data[k][2 * corner + 1]};
  }
  return view;
}

void Append(MeasuredCapture& capture, vision::BoardView view, std::string name, int image) {
  view.name = std::move(name);
  view.time_s = static_cast<double>(capture.views.size());
  capture.views.push_back(std::move(view));
  capture.image_of.push_back(image);
}

}  // namespace

fs::path MeasuredFolder(const std::string& name) {
  const char* given = std::getenv("PLUMBLINE_MEASURED");
  const fs::path folder = fs::path(given != nullptr ? given : "../shared/measured") / name;
  return fs::exists(folder) ? folder : fs::path();
}

MeasuredCapture OpenCvSample(const std::string& camera) {
  MeasuredCapture capture{"OpenCV " + camera, {9, 6, 0.025}, {640, 480}, {}, {}, {}};
  const fs::path folder = MeasuredFolder("camera-chessboards/opencv-left-right");
  const auto names = camera::ListImageNames(folder.string());
  if (folder.empty() || !names) return capture;
  for (const std::string& name : *names) {
    if (name.rfind(camera, 0) != 0) continue;
    const auto image = camera::ReadImage((folder / name).string());
    const auto view = image ? vision::DetectBoard(image->View(), capture.board)
                            : Result<vision::BoardView>(Error{image.error()});
    if (view) {
      Append(capture, *view, name, static_cast<int>(capture.views.size()));
    } else {
      capture.missed.push_back(name + ": " + view.error());
    }
  }
  return capture;
}

MeasuredCapture ZhangSquares() {
  constexpr double kPitch_in = 0.888889, kMetresPerInch = 0.0254;
  MeasuredCapture capture{"Zhang 1998", {8, 8, kPitch_in * kMetresPerInch}, {640, 480}, {}, {}, {}};
  const fs::path folder = MeasuredFolder("camera-chessboards/zhang1998");
  if (folder.empty()) return capture;
  const auto model = Numbers(folder / "Model.txt");
  for (int image = 1; image <= 5; ++image) {
    const auto data = Numbers(folder / ("data" + std::to_string(image) + ".txt"));
    for (std::size_t corner = 0; corner < 4; ++corner) {
      Append(capture, ViewOfCorner(model, data, corner, kPitch_in),
             "image " + std::to_string(image), image);
    }
  }
  return capture;
}

MeasuredCapture RobotCharuco() {
  // 5 x 7 squares; corners are numbered row by row from the top left.
  MeasuredCapture capture{"robot ChArUco",
                          {4, 6, 0.036195, target::BoardKind::kCharuco, 0.018256, "aruco-6x6-250"},
                          {1600, 1200},
                          {},
                          {},
                          {}};
  const fs::path folder = MeasuredFolder("robot-charuco-rct");
  if (folder.empty()) return capture;
  std::map<int, vision::BoardView> views;
  for (const auto& row : Numbers(folder / "corners_opencv46.csv")) {
    if (row.size() != 6) continue;  // the line of names
    vision::BoardView& view = views[static_cast<int>(row[0])];
    view.corners_px.resize(24, lens::Vec2::Zero());
    view.seen.resize(24, false);
    // OpenCV 4.6's ChArUco module puts the centre of the top left pixel at (0.5, 0.5).
    const auto corner = static_cast<std::size_t>(row[1]);
    view.corners_px.at(corner) = {row[4] - 0.5, row[5] - 0.5};
    view.seen.at(corner) = true;
  }
  for (auto& [image, view] : views) Append(capture, view, std::to_string(image), image);
  return capture;
}

std::vector<MeasuredCapture> AllMeasuredCaptures() {
  std::vector<MeasuredCapture> all;
  for (MeasuredCapture& capture : std::vector<MeasuredCapture>{
           OpenCvSample("left"), OpenCvSample("right"), ZhangSquares(), RobotCharuco()}) {
    if (!capture.views.empty()) all.push_back(std::move(capture));
  }
  return all;
}

}  // namespace plumbline::lens_captures
