#include "app/vision/camera/lens_messages.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "app/base/target/declared_facts.h"
#include "app/base/text/text.h"

namespace plumbline::vision {
namespace {

log::Event LogEventOf(const lens::ZoomTransition& transition) {
  switch (transition.to) {
    case lens::ZoomState::kValid:
      return log::Event::kLensValid;
    case lens::ZoomState::kStale:
      return log::Event::kLensStale;
    case lens::ZoomState::kRefused:
      return log::Event::kLensRefused;
    case lens::ZoomState::kUnknown:
      return transition.why == lens::ZoomReason::kSensorLost ? log::Event::kLensUnknown
                                                             : log::Event::kLensState;
    default:
      return transition.from == lens::ZoomState::kValid ? log::Event::kLensInvalidated
                                                        : log::Event::kLensState;
  }
}

}  // namespace

log::LogEntry TransitionEntry(const lens::ZoomTransition& transition, const std::string& tags) {
  const std::string state(lens::ZoomStateText(transition.to));
  const std::string at =
      transition.zoom_counts ? fmt::format(" (zoom {})", *transition.zoom_counts) : "";
  const bool explain = !tags.empty() && transition.why == lens::ZoomReason::kTagsBad;
  std::vector<log::LogField> fields = {{"CAMERA_STATE", state}};
  if (transition.zoom_counts) {
    fields.push_back({"ZOOM_COUNTS", fmt::format("{}", *transition.zoom_counts)});
  }
  return {LogEventOf(transition),
          fmt::format("camera {}: {}{}{}", state, lens::ZoomReasonText(transition.why), at,
                      explain ? "; " + tags : ""),
          fields};
}

std::string BoardViewsText(std::size_t count) {
  return fmt::format("{} view{}", count, count == 1 ? "" : "s");
}

log::LogEntry BoardProgressEntry(lens::BoardPrompt prompt, const lens::BoardGuidance& guidance) {
  return {
      log::Event::kBoardProgress,
      fmt::format("camera: {} of the board, about {} expected, {:.0f} % of the image certain; {}",
                  BoardViewsText(guidance.views), guidance.expected_views,
                  100 * guidance.CertainShare(), lens::BoardPromptText(prompt))};
}

log::LogEntry LensFoundEntry(const ActiveLens& lens) {
  const double fx_px = lens.known.lens.fx;
  if (lens.calibrated) {
    return {log::Event::kLensFound,
            fmt::format("camera: lens {} from the store, f {:.1f} px", lens.id, fx_px)};
  }
  const double sd_percent = 100 * lens.log_focal_sd;
  return {log::Event::kLensFound,
          fmt::format("camera: lens interpolated between calibrated zooms, f {:.1f} px +- {:.{}f} "
                      "% (1 sd)",
                      fx_px, sd_percent, text::DecimalsFor({sd_percent}, 2))};
}

log::LogEntry LensWithheldEntry(std::int64_t id, const target::DeclaredFacts& missing) {
  return {log::Event::kLensStale,
          fmt::format("camera: lens {} of this zoom is not used: it was calibrated under the "
                      "declaration {}, which [camera] no longer makes. Calibrate again, or restore "
                      "the declaration if it is true.",
                      id, TextOf(missing))};
}

log::LogEntry PrintsEntry(const std::string& family, bool opencv) {
  return {log::Event::kTagsContradict,
          fmt::format("camera: the reference tags are {} as {} draws them, rotated by half a turn; "
                      "all tags whose drawn_by is not given are now read so. Set drawn_by = \"{}\" "
                      "in the tag file.",
                      family, opencv ? "OpenCV" : "the AprilTag library",
                      opencv ? "opencv" : "apriltag")};
}

log::LogEntry ContradictionEntry(const TagCheck& check) {
  std::string what = check.message;
  if (!check.unresolved.empty()) {
    what = fmt::format("reference tags {} contradict each other, and no majority of them agrees",
                       fmt::join(check.unresolved, ", "));
  }
  return {log::Event::kTagsContradict,
          fmt::format("camera: {}. The lens was calibrated with these tags in place, so another "
                      "calibration is not requested. Check the tags' places and drawn_by in the "
                      "tag file; command 9 calibrates again.",
                      what)};
}

}  // namespace plumbline::vision
