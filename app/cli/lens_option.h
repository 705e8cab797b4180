// Files of a lens and of tag bodies that commands read, with their error messages.
#pragma once

#include <optional>
#include <string>

#include "app/vision/lens_files/lens_files.h"
#include "app/vision/tracking/bodies.h"

namespace plumbline::cli {

/// Reads a lens; prints the reason on failure.
/// @param force  accept a lens whose calibration was refused
std::optional<vision::LensFile> ReadUsableLens(const std::string& path, bool force);

/// Reads tags and bodies; prints the faults and warnings of the file.
std::optional<target::TagDatabase> ReadBodies(const std::string& path);

}  // namespace plumbline::cli
