#include "app/vision/camera/camera_lenses.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/base/target/declared_facts.h"
#include "app/base/text/printed_digits.h"
#include "app/base/text/utc_text.h"
#include "app/vision/camera/lens_messages.h"
#include "app/vision/lens_store/stored_views.h"

namespace plumbline::vision {
namespace {

/// Dead band of a lens, as a relative change of its focal length: this moves the corner of a 1080p
/// image by 0.3 px. It is converted to zoom counts by the slope of the lens curve.
constexpr double kRelativeFocalBand = 3e-4;
/// Limit on that conversion, in configured dead bands, where the curve is flat by chance.
constexpr std::int32_t kMaxBands = 10;

LensKey LensKeyFor(const camera::CameraIdentity& camera, const FrameContext& context) {
  return {camera.serial, camera.mode, context.zoom_counts.value_or(0), context.focus_counts};
}

}  // namespace

CameraLenses::CameraLenses(CameraStores& stores, const lens::ZoomSupervisorSettings& zoom,
                           const target::DeclaredFacts& declared, log::LogSink sink)
    : stores_(stores), zoom_(zoom), declared_(declared), sink_(std::move(sink)) {}

Result<CameraLenses::Found> CameraLenses::Find(const camera::CameraIdentity& camera,
                                               const FrameContext& context) {
  const LensKey key = LensKeyFor(camera, context);
  const LensTolerance tolerance{zoom_.zoom_band_counts, zoom_.focus_band_counts};
  const auto found = stores_.lenses.Find(key, tolerance, declared_);
  if (!found) return Error{found.error()};
  if (!*found || (*found)->how != LensFound::How::kCalibrated) {
    if (const auto withheld = stores_.lenses.Withheld(key, tolerance, declared_))
      sink_(LensWithheldEntry(withheld->id, MissingOf(withheld->declared, declared_)));
  }
  if (!*found) return Found{};
  const LensFound& stored = **found;
  auto lens = std::make_shared<ActiveLens>();
  lens->known = static_cast<const lens::KnownLens&>(stored.entry);
  lens->declared = stored.entry.declared;
  lens->calibrated = stored.how == LensFound::How::kCalibrated;
  lens->log_focal_sd = stored.log_focal_sd;
  if (stored.log_focal_per_count) {
    lens->band_counts =
        std::min(lens::DeadBandCounts(*stored.log_focal_per_count, kRelativeFocalBand),
                 kMaxBands * std::max(1, zoom_.zoom_band_counts));
  }
  if (!lens->calibrated) return Found{lens, nullptr};
  lens->id = stored.entry.id;
  lens->contradicted = stores_.baselines.IsContradicted(lens->id);
  return Found{lens, stores_.baselines.Find(lens->id)};
}

Result<std::int64_t> CameraLenses::Store(const camera::CameraIdentity& camera,
                                         const FrameContext& context, const BoardSession& session,
                                         double temp_C) {
  const LensCalibration& solved = *session.calibration();
  LensEntry entry;
  entry.key = LensKeyFor(camera, context);
  static_cast<lens::KnownLens&>(entry) = static_cast<const lens::KnownLens&>(solved);
  entry.rms_px = solved.rms_px;
  entry.uncertainty_px = solved.uncertainty.max_px;
  entry.board = WordsOf(solved.board);
  entry.declared = solved.declared;
  entry.corners = EncodeViews({solved.board, session.views()});
  if (std::isfinite(temp_C)) entry.temp_C = temp_C;
  entry.utc = text::TextOfUtcNow();
  const double fx_sd = std::sqrt(solved.covariance(kFx, kFx));
  const int decimals = text::DecimalsFor({fx_sd}, 2);
  sink_({log::Event::kCalibrated,
         fmt::format("camera: calibrated: f {:.{}f} px +- {:.{}f} px, projection uncertainty "
                     "{:.2g} px (both 1 sd), {} views{}",
                     solved.lens.fx, decimals, fx_sd, decimals, solved.uncertainty.max_px,
                     solved.frames_used.size(),
                     solved.notes.empty() ? "" : "; " + solved.notes.front())});
  return stores_.lenses.Append(entry);
}

void CameraLenses::StoreContradiction(const ActiveLens& lens) {
  if (lens.id == 0 || stores_.baselines.IsContradicted(lens.id)) return;
  if (const auto kept = stores_.baselines.StoreContradiction(lens.id); !kept) {
    sink_({log::Event::kTagFileFault, "reference tags: not saved: " + kept.error()});
  }
}

void CameraLenses::StoreBaseline(const ActiveLens& lens, const TagBaseline& baseline) {
  if (!lens.calibrated || lens.id == 0) return;
  if (const auto kept = stores_.baselines.Store(lens.id, baseline); !kept) {
    sink_({log::Event::kTagFileFault, "reference tags: not saved: " + kept.error()});
  }
}

}  // namespace plumbline::vision
