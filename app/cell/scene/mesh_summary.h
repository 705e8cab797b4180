// Summary of a mesh file as text and JSON (`plumbline mesh check`).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/cell/scene/mesh_file.h"

namespace plumbline::cell {

/// Possible problems of the mesh, each with its remedy.
/// @param unit  stated unit; if nullopt, lengths are in the file's own unit
std::vector<std::string> MeshWarnings(const MeshFile& file, const std::optional<std::string>& unit);

/// One line per topic, then the warnings. Lengths in mm, or in the file's unit if none was stated.
std::string MeshText(const MeshFile& file, const std::string& name,
                     const std::optional<std::string>& unit);
std::string MeshJson(const MeshFile& file, const std::string& name,
                     const std::optional<std::string>& unit);

}  // namespace plumbline::cell
