#include "drivers/camera/recorded_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include "drivers/files/open_failure.h"

namespace plumbline::camera {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxListBytes = std::uintmax_t{64} << 20;

Result<std::vector<SequenceFrame>> FramesOfFolder(const std::string& folder, double rate_hz) {
  const auto names = ListImageNames(folder);
  if (!names)
    return Error{fmt::format("{}: {}", folder, files::ReadErrorText(folder, names.error()))};
  if (names->empty()) {
    return Error{fmt::format("{}: contains no images (png, jpg, bmp, tif, pgm)", folder)};
  }
  std::vector<SequenceFrame> frames;
  for (const std::string& name : *names) {
    frames.push_back({static_cast<double>(frames.size()) / rate_hz, (fs::path(folder) / name)});
  }
  return frames;
}

Result<std::vector<SequenceFrame>> FramesOfFile(const std::string& path) {
  std::error_code why;
  const std::uintmax_t bytes = fs::file_size(path, why);
  if (!why && bytes > kMaxListBytes) return Error{fmt::format("{}: larger than 64 MB", path)};
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (!why) text << file.rdbuf();
  if (why || !file) {
    return Error{fmt::format(
        "{}: {}", path, files::ReadErrorText(path, why ? why.message() : "it cannot be read"))};
  }
  auto frames = SequenceFromCsv(text.str());
  if (!frames) return Error{fmt::format("{}: {}", path, frames.error())};
  for (SequenceFrame& frame : frames.value()) {
    if (!frame.file.empty()) frame.file = fs::path(path).parent_path() / frame.file;
  }
  return frames;
}

}  // namespace

Result<std::unique_ptr<Camera>> RecordedCamera::Create(const RecordedCameraOptions& options,
                                                       Clock clock, Sleep sleep) {
  if (!(options.rate_hz >= 0.01 && options.rate_hz <= 1000)) {
    return Error{fmt::format("recorded camera: {} Hz is outside 0.01..1000", options.rate_hz)};
  }
  std::error_code why;
  auto frames = fs::is_directory(options.path, why) ? FramesOfFolder(options.path, options.rate_hz)
                                                    : FramesOfFile(options.path);
  if (!frames) return frames.failure();
  return std::unique_ptr<Camera>(
      new RecordedCamera(options, std::move(frames).value(), clock, sleep));
}

RecordedCamera::RecordedCamera(RecordedCameraOptions options, std::vector<SequenceFrame> frames,
                               Clock clock, Sleep sleep)
    : options_(std::move(options)), frames_(std::move(frames)), clock_(clock), sleep_(sleep) {
  const double length_s = frames_.back().t_s - frames_.front().t_s;
  const double last_s = frames_.size() > 1 ? frames_.back().t_s - frames_[frames_.size() - 2].t_s
                                           : 1 / options_.rate_hz;
  period_s_ = length_s + last_s;
  rate_hz_ = static_cast<double>(frames_.size()) / period_s_;
  identity_.serial = options_.serial.empty() ? "recorded" : options_.serial;
  identity_.mode = options_.mode;
}

double RecordedCamera::TimeOf(std::size_t n) const {
  const std::size_t repeats = n / frames_.size();
  return *start_s_ + static_cast<double>(repeats) * period_s_ + frames_[n % frames_.size()].t_s -
         frames_.front().t_s;
}

CameraResult RecordedCamera::Show(std::size_t n, CameraFrame& frame) {
  const SequenceFrame& recorded = frames_[n % frames_.size()];
  if (recorded.file.empty()) {
    problem_ = fmt::format("{}: the camera was lost at this point of the recording", options_.path);
    return CameraResult::kLost;
  }
  auto image = options_.read(recorded.file);
  if (!image) {
    problem_ = fmt::format("{}: {}", recorded.file, image.error());
    return CameraResult::kUnusable;
  }
  const image::ImageSize size = image->View().size();
  if (!size_) {
    size_ = size;
    if (identity_.mode.empty()) {
      identity_.mode = fmt::format("recorded {}x{}@{:.4g}", size.width, size.height, rate_hz_);
    }
  }
  if (size != *size_) {
    problem_ = fmt::format("{}: {} x {} px, but the first image has {} x {}", recorded.file,
                           size.width, size.height, size_->width, size_->height);
    return CameraResult::kUnusable;
  }
  image_ = std::move(image).value();
  frame = {image_.View(), TimeOf(n), n};
  return CameraResult::kFrame;
}

CameraResult RecordedCamera::Read(double timeout_s, CameraFrame& frame) {
  problem_.clear();
  if (!start_s_) start_s_ = clock_();
  if (!HasFrame(next_)) {
    problem_ = fmt::format("{}: end of the recording", options_.path);
    return CameraResult::kEnded;
  }
  if (options_.paced) {
    const double now_s = clock_(), due_s = TimeOf(next_);
    if (due_s > now_s + timeout_s) {
      sleep_(timeout_s);
      problem_ = fmt::format("{}: the next frame is not due yet", options_.path);
      return CameraResult::kNoFrame;
    }
    sleep_(std::max(0.0, due_s - now_s));
    // Take the newest frame that is due; skip whole missed repeats at once.
    if (options_.repeat && now_s - due_s > period_s_) {
      next_ += frames_.size() * static_cast<std::size_t>((now_s - due_s) / period_s_);
    }
    while (HasFrame(next_ + 1) && TimeOf(next_ + 1) <= now_s) ++next_;
  }
  return Show(next_++, frame);
}

}  // namespace plumbline::camera
