#include "app/cli/live_track.h"

#include <fmt/format.h>

#include <iostream>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "app/cli/exit_codes.h"
#include "app/cli/interruption.h"
#include "app/vision/tracking/track_json.h"
#include "drivers/camera/image_file.h"
#include "drivers/clock.h"

namespace plumbline::cli {
namespace {

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

}  // namespace

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

}  // namespace plumbline::cli
