// Reader of the tag database: single tags and the bodies that carry tags.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "app/base/config/fault.h"
#include "app/base/target/tags.h"

namespace plumbline::config {

/// Reads a tag database:
///
///   schema = 1
///   drawn_by = "opencv"          # optional, also in [[body]], [[body.tag]] and [[tag]]: the
///   library
///                                # whose pictures were printed, "apriltag" or "opencv"
///   [[tag]]                      # a tag on its own
///   id = 17
///   size_mm = 80.0               # side of the black square
///   [[body]]
///   name = "gripper"
///   size_mm = 80.0               # default for its tags
///   place_sd_mm = 0.02           # optional: standard deviation of its tags' positions, per axis
///   [[body.tag]]
///   id = 3
///   xyz_mm = [0.0, 100.0, 0.0]   # the tag's centre in the body's frame
///   rpy_deg = [0.0, 0.0, 0.0]    # its axes (x right, y down, z into it): Rz(y) Ry(p) Rx(r)
///
/// Reports all faults at once. A duplicate id and a duplicate body name are faults.
/// @param file  name used in faults
/// @return      nullopt if there is a fault
std::optional<target::TagDatabase> TagDatabaseFromText(std::string_view text,
                                                       const std::string& file, FaultList& faults);

}  // namespace plumbline::config
