// Codec of plumbline-mesh's response. A malicious file may have taken over that process, so the
// response is untrusted.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/cell/scene/mesh_format.h"
#include "firmware-like/result.h"
#include "firmware-like/scene/triangle_mesh.h"

namespace plumbline::cell {

/// Mesh as stored in the file, in the file's unit; may be invalid (see CheckMesh).
struct RawMesh {
  scene::TriangleMesh mesh;
  std::uint64_t other_elements = 0;  ///< number of points and lines, which have no surface
  std::vector<std::string> outside;  ///< references to other files and addresses; never opened
  std::uint64_t outside_count = 0;   ///< number of references; `outside` has the first of them
};

inline constexpr std::size_t kMaxReferences = 8, kMaxReferenceLength = 200, kLongestReason = 1000;

std::vector<std::uint8_t> EncodeMeshResponse(const Result<RawMesh>& answer);

/// Maximum size of a response within these limits.
std::size_t MaxMeshResponseBytes(const MeshLimits& limits);

/// @return  nullopt if the bytes are not a complete response or exceed the limits. In texts,
///          characters other than printable ASCII are replaced by "?".
std::optional<Result<RawMesh>> DecodeMeshResponse(std::span<const std::uint8_t> bytes,
                                                  const MeshLimits& limits);

}  // namespace plumbline::cell
