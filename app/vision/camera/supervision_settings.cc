#include "app/vision/camera/supervision_settings.h"

#include <algorithm>

namespace plumbline::vision {
namespace {

constexpr double kMinPlaceSd_m = 1e-6;  ///< keeps the fit regular if a place is declared exact

}  // namespace

LensSupervisorSettings LensSupervisorSettingsFrom(const config::CameraConfig& camera,
                                                  const config::VisionConfig& vision) {
  const config::TagsConfig& tags = vision.tags;
  LensSupervisorSettings settings;
  settings.name = camera.name;
  settings.zoom = camera.zoom.supervision;
  settings.acceptable_px = vision.board.acceptable_px;
  settings.cell = config::CellReferenceTags(tags);
  settings.tag_check.place_sd_m =
      std::max(settings.cell.place_sd_m.value_or(tags.place_sd_m), kMinPlaceSd_m);
  for (const target::Body& body : tags.database.bodies) settings.bodies.push_back(body.name);
  settings.X_WK = tags.X_WK;
  settings.family = tags.family;
  if (const auto family = target::TagFamilyOfName(tags.family)) {
    settings.opencv_turns = target::OpenCvTurns(*family);
  }
  settings.tool = tags.tool;
  settings.tip_T = tags.tip_T;
  return settings;
}

BoardSettings BoardSettingsFrom(const config::BoardConfig& config,
                                const target::DeclaredFacts& declared) {
  BoardSettings board;
  board.board = config.board;
  board.views = config.views;
  board.max_views = config.max_views;
  board.patience_s = config.patience_s;
  board.options = {config.acceptable_px, config.distance_m, declared};
  return board;
}

}  // namespace plumbline::vision
