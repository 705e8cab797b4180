// Mesh files through Coin and Assimp: only in the process that may die.
#pragma once

#include <cstdint>
#include <span>

#include "app/scene/mesh_message.h"

namespace plumbline {

/// Loads what Coin needs from outside; before the process is closed off.
void PrepareVrmlParser();

/// Reads the triangles of a file that lies in memory. No other file is opened: what the file names
/// is listed in `outside`, and where geometry hangs on it, refused.
Result<RawMesh> ParseMesh(MeshFormat format, std::span<const std::uint8_t> bytes,
                          std::uint64_t most_triangles);

/// VRML97 by Coin.
Result<RawMesh> ParseVrml(std::span<const std::uint8_t> bytes, std::uint64_t most_triangles);

/// The others by Assimp.
Result<RawMesh> ParseWithAssimp(MeshFormat format, std::span<const std::uint8_t> bytes,
                                std::uint64_t most_triangles);

/// "12345 triangles or more; the limit is 2000000: ..."
Error TooManyTriangles(std::uint64_t count, std::uint64_t most);

/// Remembers a name that was not opened, once.
void NoteOutside(RawMesh& raw, const std::string& name);

/// No scene of a cell is nested or repeated as often.
inline constexpr int kDeepestNode = 200;
inline constexpr std::uint64_t kMostNodes = 1'000'000;

}  // namespace plumbline
