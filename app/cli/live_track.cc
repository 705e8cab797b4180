#include "app/cli/live_track.h"

#include <fmt/format.h>

#include <iostream>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "app/cli/exit_codes.h"
#include "app/cli/interruption.h"
#include "app/tracking/track_json.h"
#include "drivers/camera/image_file.h"
#include "drivers/clock.h"

namespace plumbline {
namespace {

constexpr double kTimeout_s = 0.2;       // so soon Ctrl-C is seen
constexpr double kFirstFrame_s = 10;     // a camera that has sent none by then will send none
constexpr std::size_t kMostTold = 1000;  // of different messages

/// Says each thing once, until it is forgotten.
class Teller {
 public:
  void Tell(const std::string& what) {
    if (told_.size() < kMostTold && told_.insert(what).second) std::cerr << what << '\n';
  }
  void Forget() { told_.clear(); }

 private:
  std::set<std::string> told_;
};

/// What is missing in a frame though the camera is well.
void TellOf(const TrackedFrame& frame, Teller& teller) {
  if (frame.limited) {
    teller.Tell("more dark regions than are looked at; tags may be missing; try --threshold");
  }
  for (const SeenBody& body : frame.bodies) {
    for (const int id : body.left_out) {
      teller.Tell(
          fmt::format("tag {} of \"{}\" contradicts its other tags and is left out: moved, or "
                      "wrong in --bodies",
                      id, body.body->name));
    }
  }
}

}  // namespace

int TrackLive(Camera& camera, Tracker& tracker, const LensFile& lens,
              const LiveTrackOptions& options) {
  const Interruption interruption;
  Teller teller;
  CameraFrame frame;
  const double began_s = MonotonicSeconds();
  std::optional<double> first_s, lost_s;
  int tracked = 0;
  while (!Interruption::Asked() && std::cout && (options.frames == 0 || tracked < options.frames)) {
    const CameraResult result = camera.Read(kTimeout_s, frame);
    for (const std::string& remark : camera.TakeRemarks()) teller.Tell(remark);
    if (result == CameraResult::kEnded) break;
    if (result != CameraResult::kFrame) {
      const bool is_lost = result == CameraResult::kLost;
      const std::string problem(camera.problem());
      if (is_lost || result == CameraResult::kUnusable) teller.Tell(problem);
      if (MissingImageCodecs()) return kExitFault;  // as with every further image of the recording
      if (is_lost && !lost_s) lost_s = MonotonicSeconds();
      if (first_s || options.recording) {
        if (result == CameraResult::kWaiting) SleepSeconds(kTimeout_s);
        continue;
      }
      if (is_lost) return kExitFault;
      if (MonotonicSeconds() - began_s > kFirstFrame_s) {
        std::cerr << problem << '\n';
        return kExitFault;
      }
      continue;
    }
    if (lost_s) {
      std::cerr << fmt::format("the camera is back after {:.1f} s\n", MonotonicSeconds() - *lost_s);
      lost_s.reset();
      teller.Forget();
      tracker.Forget();
    }
    if (frame.luma.size() != lens.size) {
      std::cerr << fmt::format(
          "{}: its frames have {} x {} pixels, the lens of {} was calibrated at {} x {}; use the "
          "mode of the calibration, or calibrate in this one\n",
          camera.identity().mode, frame.luma.width, frame.luma.height, options.lens_name,
          lens.size.width, lens.size.height);
      return kExitFault;
    }
    if (!first_s) first_s = frame.time_s;
    const TrackedFrame& seen = tracker.Update(frame.luma, frame.time_s, &lens);
    TellOf(seen, teller);
    const double t_s = frame.time_s - *first_s;
    if (options.json) {
      std::cout << TrackJsonLine(seen, t_s, frame.sequence);
    } else {
      std::cout << fmt::format("frame {}, {:.3f} s: ", frame.sequence, t_s) << TrackText(seen);
    }
    std::cout << std::flush;
    ++tracked;
  }
  if (tracked > 0 || Interruption::Asked() || !std::cout) return kExitOk;
  std::cerr << "no frame could be used\n";
  return kExitFault;
}

}  // namespace plumbline
