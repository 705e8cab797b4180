// Shape searches for the event time from which an effect acts: a slip, a collision, a camera zoom.
#pragma once

#include "app/measure/diagnosis/linear/shape_search.h"

namespace plumbline::measure {

/// For `step_event`: proposes the best event time for the base and for the tool, among those
/// halfway between successive rows (by row number if no time was recorded, or if t_s restarts in
/// another session), and the best of those between two sessions, which are few. Two events of one
/// explanation, of whatever effect, must have at least a tenth of the rows (at least six) between
/// them; fewer rows are outliers instead.
const ShapeSearch& StepEventSearch();

/// For `tilt_event`: proposes the best of the same times for a rotation of the base.
const ShapeSearch& TiltEventSearch();

/// For `offset_event`: proposes the time at which a jump of one joint explains most, for all
/// joints.
const ShapeSearch& OffsetEventSearch();

/// For `camera_zoom`: proposes the best of the times at which zoom_counts changed, if recorded, or
/// otherwise of the same times; and offers a zoom error from the first row on, without a time.
const ShapeSearch& CameraZoomSearch();

}  // namespace plumbline::measure
