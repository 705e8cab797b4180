// For programs that look once and end: a state of now, and what is measured in it.
#pragma once

#include "app/view_process/viewer.h"

namespace plumbline {

/// @return  false: none came within `patience_s`; the viewer's link_problem says why
bool AwaitState(Viewer& viewer, double patience_s);

/// Waits until the object table and its meshes are read, then for a state of now with what is
/// measured in it. Where they take longer than `meshes_patience_s`, with what there is.
void AwaitMeasured(Viewer& viewer, double meshes_patience_s);

}  // namespace plumbline
