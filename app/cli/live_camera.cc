#include "app/cli/live_camera.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>

#include "app/cli/number_option.h"
#include "drivers/camera/image_file.h"
#include "drivers/camera/registry.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::cli {
namespace {

/// Parses "1920x1080"; nullopt if the text does not have this form.
std::optional<image::ImageSize> SizeFromText(std::string_view text) {
  image::ImageSize size;
  const char* end = text.data() + text.size();
  const auto [x, first] = std::from_chars(text.data(), end, size.width);
  if (first != std::errc() || x == end || *x != 'x') return std::nullopt;
  const auto [rest, second] = std::from_chars(x + 1, end, size.height);
  if (second != std::errc() || rest != end || size.width < 1 || size.height < 1 ||
      size.width > camera::kMaxImageSide_px || size.height > camera::kMaxImageSide_px) {
    return std::nullopt;
  }
  return size;
}

}  // namespace

void AddCameraOptions(CLI::App& command, LiveCameraOptions& options) {
  CLI::Option* camera = command.add_option(
      "--camera", options.camera,
      "A camera, by the name that `plumbline cameras` prints, the FIFO of a DV camcorder, or a "
      "recording: a folder of images or a table t_s,file (*.csv)");
  command.option_defaults()->group("With --camera");
  command
      .add_option("--size", options.size,
                  "Image size, WIDTHxHEIGHT; default: that of the lens calibration")
      ->needs(camera)
      ->check(CLI::Validator(
          [](const std::string& text) {
            return SizeFromText(text) ? std::string()
                                      : text + " is not WIDTHxHEIGHT, such as 1920x1080";
          },
          ""));
  command
      .add_option("--rate-hz", options.rate_hz,
                  "Minimum frame rate; for a folder of images, the playback rate")
      ->needs(camera)
      ->capture_default_str()
      ->check(NumberWithin(0.01, 1000));
  command.add_option("--exposure-ms", options.exposure_ms, "Fixed exposure time")
      ->needs(camera)
      ->check(NumberWithin(0.001, 60000));
  command.add_option("--gain", options.gain_counts, "Fixed gain, in units of the camera")
      ->needs(camera)
      ->check(WholeNumberWithin(0, 1 << 24));
  command.add_option("--white-balance-K", options.white_balance_K, "Fixed white balance")
      ->needs(camera)
      ->check(NumberWithin(1000, 40000));
  command.add_option("--focus", options.focus_counts, "Fixed focus, in units of the camera")
      ->needs(camera)
      ->check(WholeNumberWithin(0, 1 << 24));
  command.add_flag("--fast", options.fast, "Play a recording as fast as it can be processed")
      ->needs(camera);
  command.add_flag("--repeat", options.repeat, "Play a recording in a loop")->needs(camera);
  command.option_defaults()->group("Options");
}

bool IsRecording(const std::string& camera) {
  std::error_code why;
  return camera.ends_with(".csv") || std::filesystem::is_directory(camera, why);
}

namespace {

std::string_view KindOf(const std::string& camera) {
  std::error_code why;
  if (IsRecording(camera)) return "recorded";
  return std::filesystem::is_fifo(camera, why) ? "dv" : "v4l2";
}

}  // namespace

Result<std::unique_ptr<camera::Camera>> MakeLiveCamera(const LiveCameraOptions& options) {
  camera::CameraConnection connection;
  connection.recorded.path = options.camera;
  connection.recorded.read = camera::ReadImage;
  connection.recorded.rate_hz = options.rate_hz;
  connection.recorded.paced = !options.fast;
  connection.recorded.repeat = options.repeat;
  connection.v4l2.device = options.camera;
  connection.dv.fifo = options.camera;
  connection.v4l2.mode.rate_hz = options.rate_hz;
  if (const auto size = SizeFromText(options.size)) connection.v4l2.mode.size = *size;
  camera::CameraSettings& settings = connection.v4l2.settings;
  if (options.exposure_ms > 0) settings.exposure_s = 1e-3 * options.exposure_ms;
  if (options.white_balance_K > 0) settings.white_balance_K = options.white_balance_K;
  if (options.gain_counts >= 0) settings.gain_counts = options.gain_counts;
  if (options.focus_counts >= 0) settings.focus_counts = options.focus_counts;
  return camera::MakeCamera(KindOf(options.camera), connection);
}

}  // namespace plumbline::cli
