// Lenses and tag baselines of one camera, in the stores that all cameras share.
#pragma once

#include <cstdint>
#include <memory>

#include "app/vision/camera/board_session.h"
#include "app/vision/camera/camera_stores.h"
#include "app/vision/camera/lens_supervisor.h"
#include "firmware-like/result.h"

namespace plumbline::vision {

/// Calls block on disk access. Not thread-safe; the stores are.
class CameraLenses {
 public:
  /// A lens for a zoom; both null if the store has none.
  struct Found {
    std::shared_ptr<const ActiveLens> lens;
    std::shared_ptr<const TagBaseline> baseline;  ///< null for an interpolated lens
  };

  /// @param stores    must outlive this object
  /// @param declared  a lens that was calibrated under further declarations is not used
  CameraLenses(CameraStores& stores, const lens::ZoomSupervisorSettings& zoom,
               const target::DeclaredFacts& declared, log::LogSink sink);

  /// The lens of a camera for the zoom and focus of `context`. Logs if the store has one that is
  /// not used because a declaration was withdrawn.
  Result<Found> Find(const camera::CameraIdentity& camera, const FrameContext& context);

  /// Logs an accepted calibration and appends it to the store.
  /// @param temp_C  of the robot; NaN if unknown
  /// @return        the id of the lens
  Result<std::int64_t> Store(const camera::CameraIdentity& camera, const FrameContext& context,
                             const BoardSession& session, double temp_C);

  /// Stores the residuals of the reference tags when the lens was last verified. A lens that is
  /// interpolated or not stored has no baseline.
  void StoreBaseline(const ActiveLens& lens, const TagBaseline& baseline);

  /// Stores that the reference tags contradict the lens, so that a restart does not request the
  /// same calibration again.
  void StoreContradiction(const ActiveLens& lens);

 private:
  CameraStores& stores_;
  const lens::ZoomSupervisorSettings zoom_;
  const target::DeclaredFacts declared_;
  const log::LogSink sink_;
};

}  // namespace plumbline::vision
