// Sheets of tags to scale.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/base/target/tag_family.h"
#include "app/vision/print/paper.h"
#include "firmware-like/result.h"

namespace plumbline::vision {

/// Lays out tags on as few sheets as possible, in portrait or landscape. Each has a white border of
/// one cell, an arrow that points up, and its family, id and size below it. Tags are drawn in the
/// orientation that the detector regards as upright, which for the AprilTag families is that
/// library's.
/// @param ids   of the tags, not empty, all of the family
/// @param side_mm  side of the black square, from outer edge to outer edge
/// @return      the sheets, or an error that names the largest size that fits
Result<Document> TagSheets(const target::TagFamily& family, const std::vector<int>& ids,
                           double side_mm, const Paper& paper);

/// The lines that declare one tag in bodies.toml.
std::vector<std::string> TagLines(int id, double side_mm);

/// A further line of that table, which names the origin of the print; nullopt for a family that all
/// libraries draw alike.
std::optional<std::string> DrawnByLine(const target::TagFamily& family);

}  // namespace plumbline::vision
