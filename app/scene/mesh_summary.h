// What is in a mesh file, in words and as JSON.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/scene/mesh_file.h"

namespace plumbline {

/// What somebody should know before the mesh is used, each with what to do.
/// @param unit  as it was stated; nothing: the file was read as it stands
std::vector<std::string> MeshWarnings(const MeshFile& file, const std::optional<std::string>& unit);

/// One line a topic, then the warnings. Lengths in mm, or in the file's unit where none was stated.
std::string MeshText(const MeshFile& file, const std::string& name,
                     const std::optional<std::string>& unit);
std::string MeshJson(const MeshFile& file, const std::string& name,
                     const std::optional<std::string>& unit);

}  // namespace plumbline
