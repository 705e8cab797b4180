// plumbline track: poses of tags and bodies in an image or a camera stream.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/file_head.h"
#include "app/cli/lens_option.h"
#include "app/cli/number_option.h"
#include "app/cli/progress.h"
#include "app/vision/lens/lens_json.h"
#include "app/vision/tracking/track_json.h"
#include "app/vision/tracking/tracker.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/image_file.h"
#include "drivers/camera/registry.h"
#include "drivers/clock.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/result.h"

namespace plumbline::cli {
namespace {

// The camera, live or recorded.

struct LiveCameraOptions {
  std::string camera;  ///< device, serial number, or path of a recording
  std::string size;    ///< "1920x1080"; empty: the largest that reaches rate_hz
  double rate_hz = 20;
  double exposure_ms = 0;  ///< this and the next three: 0 or -1 if not given
  double white_balance_K = 0;
  int gain_counts = -1, focus_counts = -1;
  bool fast = false, repeat = false;
};

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

/// Adds --camera and the options that depend on it.
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

/// True for a recording: a folder of images, or a sequence file (*.csv).
bool IsRecording(const std::string& camera) {
  std::error_code why;
  return camera.ends_with(".csv") || std::filesystem::is_directory(camera, why);
}

std::string_view KindOf(const std::string& camera) {
  std::error_code why;
  if (IsRecording(camera)) return "recorded";
  return std::filesystem::is_fifo(camera, why) ? "dv" : "v4l2";
}

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

// Tracking of tags and bodies in a camera stream, printed to standard output.

struct LiveTrackOptions {
  std::string lens_name;   ///< for messages
  int frames = 0;          ///< number of frames to track; 0: until the recording ends or Ctrl-C
  bool json = false;       ///< print one line of JSON per frame instead of text
  bool recording = false;  ///< the camera is a recording; do not give up if no frame arrives
};

constexpr double kTimeout_s = 0.2;          // bounds the delay of Ctrl-C
constexpr double kFirstFrame_s = 10;        // give up on a camera that has sent no frame by then
constexpr std::size_t kMaxMessages = 1000;  // different messages

/// Prints each message to standard error only once, until Reset().
class MessagePrinter {
 public:
  void Print(const std::string& message) {
    if (printed_.size() < kMaxMessages && printed_.insert(message).second) {
      std::cerr << message << '\n';
    }
  }
  void Reset() { printed_.clear(); }

 private:
  std::set<std::string> printed_;
};

/// Warns about tags that are missing in a frame although the camera works.
void WarnAboutFrame(const vision::TrackedFrame& frame, MessagePrinter& messages) {
  if (frame.limited) {
    messages.Print(
        "the image has too many dark regions to inspect all of them; tags may be missing; try "
        "--threshold");
  }
  for (const vision::SeenBody& body : frame.bodies) {
    for (const int id : body.left_out) {
      messages.Print(
          fmt::format("tag {} of \"{}\" contradicts the other tags of this body and is ignored: it "
                      "has moved, or its position in --bodies is wrong",
                      id, body.body->name));
    }
  }
}

/// Prints the tracked tags and bodies to standard output, and each problem once to standard error.
/// Ctrl-C stops it after the current frame.
/// @return the exit code
int TrackLive(camera::Camera& camera, vision::Tracker& tracker, const vision::LensFile& lens,
              const LiveTrackOptions& options) {
  const Interruption interruption;
  MessagePrinter messages;
  camera::CameraFrame frame;
  const double start_s = MonotonicSeconds();
  std::optional<double> first_s, lost_s;
  int tracked = 0;
  while (!Interruption::Requested() && std::cout &&
         (options.frames == 0 || tracked < options.frames)) {
    const camera::CameraResult result = camera.Read(kTimeout_s, frame);
    for (const std::string& remark : camera.TakeRemarks()) messages.Print(remark);
    if (result == camera::CameraResult::kEnded) break;
    if (result != camera::CameraResult::kFrame) {
      const bool is_lost = result == camera::CameraResult::kLost;
      const std::string problem(camera.problem());
      if (is_lost || result == camera::CameraResult::kUnusable) messages.Print(problem);
      if (!camera::CheckImageCodecs()) return kExitFault;  // the remaining images would fail too
      if (is_lost && !lost_s) lost_s = MonotonicSeconds();
      if (first_s || options.recording) {
        if (result == camera::CameraResult::kWaiting) SleepSeconds(kTimeout_s);
        continue;
      }
      if (is_lost) return kExitFault;
      if (MonotonicSeconds() - start_s > kFirstFrame_s) {
        std::cerr << problem << '\n';
        return kExitFault;
      }
      continue;
    }
    if (lost_s) {
      std::cerr << fmt::format("camera restored after {:.1f} s\n", MonotonicSeconds() - *lost_s);
      lost_s.reset();
      messages.Reset();
      tracker.Forget();
    }
    if (frame.luma.size() != lens.size) {
      std::cerr << fmt::format(
          "{}: the frames have {} x {} pixels, but the lens in {} was calibrated at {} x {}; use "
          "the mode of the calibration, or calibrate in this mode\n",
          camera.identity().mode, frame.luma.width, frame.luma.height, options.lens_name,
          lens.size.width, lens.size.height);
      return kExitFault;
    }
    if (!first_s) first_s = frame.time_s;
    const vision::TrackedFrame& seen = tracker.Update(frame.luma, frame.time_s, &lens);
    WarnAboutFrame(seen, messages);
    const double t_s = frame.time_s - *first_s;
    if (options.json) {
      std::cout << vision::TrackJsonLine(seen, t_s, frame.sequence);
    } else {
      std::cout << fmt::format("frame {}, {:.3f} s: ", frame.sequence, t_s)
                << vision::TrackText(seen);
    }
    std::cout << std::flush;
    ++tracked;
  }
  if (tracked > 0 || Interruption::Requested() || !std::cout) return kExitOk;
  std::cerr << "no usable frame was received\n";
  return kExitFault;
}

struct TrackOptions {
  std::string image, intrinsics, bodies, family = "36h11";
  double tag_size_mm = 0;
  LiveCameraOptions live;
  int threshold = -1, frames = 0;
  bool force = false, json = false;
};

/// Checks that the tag family contains all ids of the database.
bool AllInFamily(const TrackOptions& options, const target::TagDatabase& database,
                 const target::TagFamily& family) {
  const int count = static_cast<int>(family.codes.size());
  std::vector<int> ids;
  for (const target::StandaloneTag& tag : database.tags) ids.push_back(tag.id);
  for (const target::Body& body : database.bodies) {
    for (const target::BodyTag& tag : body.tags) ids.push_back(tag.id);
  }
  bool all = true;
  for (const int id : ids) {
    if (id < count) continue;
    std::cerr << fmt::format("{}: {} has no tag {}, only 0..{}; give the --family of the tags\n",
                             options.bodies, family.name, id, count - 1);
    all = false;
  }
  return all;
}

std::optional<target::TagDatabase> ReadDatabase(const TrackOptions& options) {
  target::TagDatabase database;
  if (!options.bodies.empty()) {
    auto read = ReadBodies(options.bodies);
    if (!read) return std::nullopt;
    database = std::move(*read);
  }
  if (options.tag_size_mm > 0) database.default_side_m = kMetrePerMm * options.tag_size_mm;
  return database;
}

int RunOnImage(const TrackOptions& options, const vision::LensFile& lens,
               const std::vector<target::Body>& bodies, vision::Tracker& tracker) {
  if (const auto wrong = WrongFileText(options.image, config::kWantedImage)) {
    return Fail(fmt::format("{}: {}", options.image, *wrong));
  }
  const auto image = camera::ReadImage(options.image);
  if (!image) return Fail(fmt::format("{}: {}", options.image, image.error()));
  if (image->View().size() != lens.size) {
    return Fail(
        fmt::format("{}: the image has {} x {} pixels, but the lens in {} was calibrated at {} x "
                    "{}; use images "
                    "of the same camera mode, neither cropped nor scaled",
                    options.image, image->width, image->height, options.intrinsics, lens.size.width,
                    lens.size.height));
  }
  const vision::TrackedFrame& frame = tracker.Update(image->View(), 0, &lens);
  if (frame.limited) {
    std::cerr << options.image << ": the image has too many dark regions; the smaller ones were "
              << "skipped and tags may be missing; try --threshold\n";
  }
  for (const vision::SeenBody& body : frame.bodies) {
    for (const int id : body.left_out) {
      std::cerr << fmt::format(
          "{}: tag {} of \"{}\" contradicts the other tags of this body and was ignored: it has "
          "moved, or its position in {} is wrong\n",
          options.image, id, body.body->name, options.bodies);
    }
  }
  std::cout << (options.json ? vision::TrackJson(frame) : vision::TrackText(frame));
  if (options.json) return kExitOk;
  for (const target::Body& body : bodies) {
    const bool seen = std::any_of(
        frame.bodies.begin(), frame.bodies.end(),
        [&body](const vision::SeenBody& other) { return other.body->name == body.name; });
    if (!seen) std::cout << fmt::format("{:16s} not visible\n", body.name);
  }
  return kExitOk;
}

int RunLive(const TrackOptions& options, const vision::LensFile& lens, vision::Tracker& tracker) {
  LiveCameraOptions live = options.live;
  if (live.size.empty()) live.size = fmt::format("{}x{}", lens.size.width, lens.size.height);
  const auto camera = MakeLiveCamera(live);
  if (!camera) return Fail(camera.error());
  return TrackLive(**camera, tracker, lens,
                   {.lens_name = options.intrinsics,
                    .frames = options.frames,
                    .json = options.json,
                    .recording = IsRecording(options.live.camera)});
}

int Run(const TrackOptions& options) {
  if (options.image.empty() == options.live.camera.empty()) {
    std::cerr << "plumbline track: give --image FILE or --camera CAMERA\n";
    return kExitUsage;
  }
  if (options.tag_size_mm <= 0 && options.bodies.empty()) {
    std::cerr << "plumbline track: the tag size is missing; give --tag-size-mm or --bodies\n";
    return kExitUsage;
  }
  auto family = target::TagFamilyOfName(options.family);
  if (!family) {
    std::cerr << "plumbline track: --family: " << family.error() << '\n';
    return kExitUsage;
  }
  const auto lens = ReadUsableLens(options.intrinsics, options.force);
  const auto database = ReadDatabase(options);
  if (!lens || !database || !AllInFamily(options, *database, *family)) return kExitFault;
  vision::TrackerSettings settings;
  if (options.threshold >= 0) settings.detector.threshold = options.threshold;
  vision::Tracker tracker(std::move(family).value(), *database, settings);
  if (!lens->accepted) {
    std::cerr << options.intrinsics << ": warning: this lens was refused and is used by --force\n";
  }
  return options.live.camera.empty() ? RunOnImage(options, *lens, database->bodies, tracker)
                                     : RunLive(options, *lens, tracker);
}

}  // namespace

void AddTrackCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<TrackOptions>();
  CLI::App* command = app.add_subcommand(
      "track", "Find tags and bodies in an image or camera stream, with their poses");
  command->add_option("--image", options->image, "Image file; colour is converted to grey");
  AddCameraOptions(*command, options->live);
  command->add_option("--frames", options->frames, "Stop after this number of frames")
      ->needs("--camera")
      ->group("With --camera")
      ->check(WholeNumberWithin(1, 1 << 30));
  command
      ->add_option(
          "--intrinsics", options->intrinsics,
          "Lens calibration: LENS.json of plumbline calibrate-lens, XML or YAML of OpenCV\n"
          "or ROS, or ARToolKit's camera_para.dat")
      ->required();
  command
      ->add_option("--tag-size-mm", options->tag_size_mm,
                   "Side of the black square of all tags not listed in --bodies")
      ->check(NumberWithin(1, 2000));
  command->add_option("--bodies", options->bodies, "TOML file of tags and bodies");
  command->add_option("--family", options->family, "Tag family, one of " + target::TagFamilyNames())
      ->capture_default_str();
  command
      ->add_option("--threshold", options->threshold,
                   "Pixels below this grey level count as dark; default: adapts to the local "
                   "brightness")
      ->check(WholeNumberWithin(0, 255));
  command->add_flag("--force", options->force, "Use a lens whose calibration was refused");
  command->add_flag("--json", options->json, "Print JSON; for a camera, one line per frame");
  command->footer(
      "Poses are given in the camera frame: x right, y down, z forward. A tag's frame has its "
      "origin\n"
      "at the centre of the tag, x to its right, y down, z into it.\n\n"
      "Examples:\n  plumbline track --image frame.png --intrinsics lens.json --tag-size-mm 80\n"
      "  plumbline track --image frame.png --intrinsics lens.json \\\n"
      "      --bodies bodies.toml --json\n"
      "  plumbline track --camera A1B2C3 --size 1920x1080 --exposure-ms 5 \\\n"
      "      --intrinsics lens.json --bodies bodies.toml --json\n"
      "  plumbline track --camera recording --fast --intrinsics lens.json \\\n"
      "      --tag-size-mm 80 --json\n\n"
      "Ctrl-C stops tracking of a camera.\n\n"
      "Exit codes: 0 success, even if no tag was found; 1 faults in the input; 2 wrong arguments.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline::cli
