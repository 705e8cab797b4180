// What the process that reads mesh files answers, as bytes. It may have been taken over by the
// file: nothing of its answer is believed.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/scene/mesh_format.h"
#include "firmware-like/result.h"
#include "firmware-like/scene/triangle_mesh.h"

namespace plumbline {

/// As it stands in the file: in the file's unit and perhaps nonsense (see CheckMesh).
struct RawMesh {
  TriangleMesh mesh;
  std::uint64_t other_elements = 0;  ///< points and lines, which have no surface
  std::vector<std::string> outside;  ///< names of other files and addresses that were not opened
  std::uint64_t outside_count = 0;   ///< all of them; `outside` holds the first kMostOutside
};

inline constexpr std::size_t kMostOutside = 8, kLongestOutside = 200, kLongestReason = 1000;

std::vector<std::uint8_t> BytesOfMeshAnswer(const Result<RawMesh>& answer);

/// How long an answer within these limits can be.
std::size_t LargestMeshAnswer(const MeshLimits& limits);

/// @return  nothing where the bytes are no whole answer, or more than the limits allow; texts have
///          only printable ASCII characters, others are replaced by "?"
std::optional<Result<RawMesh>> MeshAnswerOfBytes(std::span<const std::uint8_t> bytes,
                                                 const MeshLimits& limits);

}  // namespace plumbline
