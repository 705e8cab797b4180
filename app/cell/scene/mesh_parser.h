// Mesh parsers based on Coin and Assimp; used only in the sandboxed process.
#pragma once

#include <cstdint>
#include <span>

#include "app/cell/scene/mesh_format.h"

namespace plumbline::cell {

/// Loads Coin's resources; call before the process is sandboxed.
void PrepareVrmlParser();

/// Parses a file in memory. No other file is opened: references to other files are listed in
/// `outside`, and are an error if geometry depends on them.
Result<RawMesh> ParseMesh(MeshFormat format, std::span<const std::uint8_t> bytes,
                          std::uint64_t most_triangles);

/// VRML97 by Coin.
Result<RawMesh> ParseVrml(std::span<const std::uint8_t> bytes, std::uint64_t most_triangles);

/// All other formats, by Assimp.
Result<RawMesh> ParseWithAssimp(MeshFormat format, std::span<const std::uint8_t> bytes,
                                std::uint64_t most_triangles);

/// "12345 triangles or more; the limit is 2000000: ..."
Error TooManyTriangles(std::uint64_t count, std::uint64_t most);

/// Notes a vertex, or an offset of a transformation, in `largest_coordinate`.
/// @param p  multiplied by the scale of the transformations that are still to be applied to it
void NoteCoordinates(RawMesh& raw, const Vec3f& p);

/// Adds a name unless the list has it, or has kMaxReferences others. @return  false if it had it
bool AddReference(std::vector<std::string>& references, const std::string& name);

/// Adds a reference to `outside`, unless it is already listed.
void NoteOutside(RawMesh& raw, const std::string& name);

/// Limits on nesting and on the number of nodes, far beyond those of real cells.
inline constexpr int kDeepestNode = 200;
inline constexpr std::uint64_t kMostNodes = 1'000'000;

}  // namespace plumbline::cell
