#include "app/cli/track_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "app/cli/exit_codes.h"
#include "app/cli/failure.h"
#include "app/cli/live_camera.h"
#include "app/cli/live_track.h"
#include "app/cli/number_option.h"
#include "app/config/body_reader.h"
#include "app/config/text_file.h"
#include "app/lens/lens_json.h"
#include "app/tracking/track_json.h"
#include "drivers/camera/image_file.h"
#include "drivers/files/open_failure.h"
#include "firmware-like/geometry/length.h"

namespace plumbline {
namespace {

struct TrackOptions {
  std::string image, intrinsics, bodies, family = "36h11";
  double tag_size_mm = 0;
  LiveCameraOptions live;
  int threshold = -1, frames = 0;
  bool force = false, json = false;
};

/// The lens, or nothing after the reason was told.
std::optional<LensFile> ReadLens(const TrackOptions& options) {
  const auto text = ReadTextFile(options.intrinsics);
  if (!text) {
    Fail(fmt::format("{}: {}", options.intrinsics, CannotBeRead(options.intrinsics, text.error())));
    return std::nullopt;
  }
  const auto lens = LensFromJson(*text);
  if (!lens) {
    Fail(fmt::format("{}: {}", options.intrinsics, lens.error()));
    return std::nullopt;
  }
  if (!lens->accepted && !options.force) {
    Fail(
        fmt::format("{}: this calibration was refused (accepted is not true): its reasons "
                    "stand there; calibrate again, or use it all the same with --force",
                    options.intrinsics));
    return std::nullopt;
  }
  return *lens;
}

/// Ids that no tag of the family has: such a tag would be looked for in vain.
bool AllInFamily(const TrackOptions& options, const TagDatabase& database,
                 const TagFamily& family) {
  const int count = static_cast<int>(family.codes.size());
  std::vector<int> ids;
  for (const LoneTag& tag : database.tags) ids.push_back(tag.id);
  for (const Body& body : database.bodies) {
    for (const BodyTag& tag : body.tags) ids.push_back(tag.id);
  }
  bool all = true;
  for (const int id : ids) {
    if (id < count) continue;
    std::cerr << fmt::format("{}: {} has no tag {}, its ids are 0..{}; give the --family printed\n",
                             options.bodies, family.name, id, count - 1);
    all = false;
  }
  return all;
}

std::optional<TagDatabase> ReadDatabase(const TrackOptions& options) {
  TagDatabase database;
  if (!options.bodies.empty()) {
    const auto text = ReadTextFile(options.bodies);
    if (!text) {
      Fail(fmt::format("{}: {}", options.bodies, CannotBeRead(options.bodies, text.error())));
      return std::nullopt;
    }
    FaultList faults;
    auto read = TagDatabaseFromText(*text, options.bodies, faults);
    std::cerr << FaultsText(faults);
    if (!read) return std::nullopt;
    database = std::move(*read);
  }
  if (options.tag_size_mm > 0) database.other_side_m = kMetrePerMm * options.tag_size_mm;
  return database;
}

int RunOnImage(const TrackOptions& options, const LensFile& lens, const std::vector<Body>& bodies,
               Tracker& tracker) {
  const auto image = ReadImage(options.image);
  if (!image) return Fail(fmt::format("{}: {}", options.image, image.error()));
  if (image->View().size() != lens.size) {
    return Fail(fmt::format(
        "{}: the image has {} x {} pixels, the lens of {} was calibrated at {} x {}; use images of "
        "the same mode of the camera, neither cut nor scaled",
        options.image, image->width, image->height, options.intrinsics, lens.size.width,
        lens.size.height));
  }
  const TrackedFrame& frame = tracker.Update(image->View(), 0, &lens);
  if (frame.limited) {
    std::cerr << options.image << ": more dark regions than are looked at; the smaller ones were "
              << "left out, tags may be missing; try --threshold\n";
  }
  for (const SeenBody& body : frame.bodies) {
    for (const int id : body.left_out) {
      std::cerr << fmt::format(
          "{}: tag {} of \"{}\" contradicts its other tags and was left out: moved, or wrong in "
          "{}\n",
          options.image, id, body.body->name, options.bodies);
    }
  }
  std::cout << (options.json ? TrackJson(frame) : TrackText(frame));
  if (options.json) return kExitOk;
  for (const Body& body : bodies) {
    const bool seen =
        std::any_of(frame.bodies.begin(), frame.bodies.end(),
                    [&body](const SeenBody& other) { return other.body->name == body.name; });
    if (!seen) std::cout << fmt::format("{:16s} not seen\n", body.name);
  }
  return kExitOk;
}

int RunLive(const TrackOptions& options, const LensFile& lens, Tracker& tracker) {
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
    std::cerr << "plumbline track: how large are the tags? give --tag-size-mm, or --bodies\n";
    return kExitUsage;
  }
  auto family = TagFamilyOfName(options.family);
  if (!family) {
    std::cerr << "plumbline track: --family: " << family.error() << '\n';
    return kExitUsage;
  }
  const auto lens = ReadLens(options);
  const auto database = ReadDatabase(options);
  if (!lens || !database || !AllInFamily(options, *database, *family)) return kExitFault;
  TrackerSettings settings;
  settings.detector.small_tags = options.live.camera.empty();  // a camera goes on meanwhile
  if (options.threshold >= 0) settings.detector.threshold = options.threshold;
  Tracker tracker(std::move(family).value(), *database, settings);
  if (!lens->accepted) {
    std::cerr << options.intrinsics << ": used by --force though it was refused\n";
  }
  return options.live.camera.empty() ? RunOnImage(options, *lens, database->bodies, tracker)
                                     : RunLive(options, *lens, tracker);
}

}  // namespace

void AddTrackCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<TrackOptions>();
  CLI::App* command = app.add_subcommand(
      "track", "Tags and bodies in an image or before a camera, and where they are");
  command->add_option("--image", options->image, "Image file; colour is turned to grey");
  AddCameraOptions(*command, options->live);
  command->add_option("--frames", options->frames, "End after so many frames of the camera")
      ->needs("--camera")
      ->check(WholeNumberWithin(1, 1 << 30));
  command
      ->add_option("--intrinsics", options->intrinsics,
                   "The lens, LENS.json of plumbline calibrate-lens")
      ->required();
  command
      ->add_option("--tag-size-mm", options->tag_size_mm,
                   "Side of the black square of every tag that --bodies does not list")
      ->check(NumberWithin(1, 2000));
  command->add_option("--bodies", options->bodies, "Tags and bodies, a TOML file");
  command->add_option("--family", options->family, "One of " + TagFamilyNames())
      ->capture_default_str();
  command
      ->add_option("--threshold", options->threshold,
                   "Pixels below this grey level are dark; without it the light around each place "
                   "decides")
      ->check(WholeNumberWithin(0, 255));
  command->add_flag("--force", options->force, "Use a lens whose calibration was refused");
  command->add_flag("--json", options->json,
                    "Answer as JSON on standard output; of a camera, one line a frame");
  command->footer(
      "Positions in the camera frame: x right, y down, z forward. A tag's frame: x to its right, "
      "y\n"
      "down, z into it, the origin at its centre.\n\n"
      "Examples:\n  plumbline track --image frame.png --intrinsics lens.json --tag-size-mm 80\n"
      "  plumbline track --image frame.png --intrinsics lens.json --bodies bodies.toml --json\n"
      "  plumbline track --camera A1B2C3 --size 1920x1080 --exposure-ms 5 --intrinsics lens.json "
      "--bodies bodies.toml --json\n"
      "  plumbline track --camera recording --fast --intrinsics lens.json --tag-size-mm 80 --json\n"
      "Ctrl-C ends the tracking of a camera.\n\n"
      "Exit codes: 0 done, also where there is no tag; 1 faults in the input; 2 wrong arguments.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline
