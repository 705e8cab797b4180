// Lens files of every form that Plumbline reads and writes.
#pragma once

#include <string>
#include <string_view>

#include "app/vision/lens/lens_json.h"
#include "app/vision/lens_store/lens_entry.h"
#include "firmware-like/result.h"

namespace plumbline::vision {

/// Reads a lens from LENS.json, from XML or YAML of cv::FileStorage, or from ARToolKit's
/// camera_para.dat; the format is recognised by the content. A file without a verdict counts as
/// accepted, and has no covariance unless it states one.
/// @return  an error with the place, the value and the remedy
Result<LensFile> LensFromFile(std::string_view bytes);

/// Extensions of the files that LensFileOf() writes, for messages.
inline constexpr const char* kWrittenEndings = ".xml, .yaml, .yml or .dat";

/// The content of a file with the extension of `path`: .xml and .yaml for OpenCV, .dat for
/// ARToolKit.
/// @return  an error for another extension
Result<std::string> LensFileOf(const LensEntry& entry, const std::string& path);

}  // namespace plumbline::vision
