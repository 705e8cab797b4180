// Moments from which an effect acts: a slip, a collision, a zoomed camera.
#pragma once

#include "app/diagnosis/shape_search.h"

namespace plumbline {

/// Of `step_event`: halfway between rows that follow each other in time (in their order where no
/// time was recorded), the best moment for the base and for the tool. Two moments of one
/// explanation, whatever begins there, have a tenth of the rows between them (six at least): fewer
/// rows are outliers, no event.
const ShapeSearch& StepEventSearch();

/// Of `tilt_event`: the same moments, the best one for a turn of the base.
const ShapeSearch& TiltEventSearch();

/// Of `camera_zoom`: where zoom_counts was recorded, the moments at which it changed, else as of a
/// step; and from the first row on, without a moment.
const ShapeSearch& CameraZoomSearch();

}  // namespace plumbline
