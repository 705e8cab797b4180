// Mesh file formats, units and limits.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/result.h"
#include "firmware-like/scene/triangle_mesh.h"

namespace plumbline::cell {

enum class MeshFormat { kVrml, kStl, kObj, kPly, kGltf, kGlb };

/// By the file name's suffix, in upper or lower case; nullopt if unknown.
std::optional<MeshFormat> MeshFormatOfName(std::string_view file);
std::optional<MeshFormat> MeshFormatOfWord(std::string_view word);  ///< "wrl", "stl", ...
std::string_view WordOf(MeshFormat format);                         ///< the suffix
inline constexpr std::string_view kMeshFormats = ".wrl, .stl, .obj, .ply, .gltf, .glb";

/// Limits of the mesh reader; exceeding one ends reading with an error that names it.
struct MeshLimits {
  std::uint64_t triangles = 2'000'000;
  std::uint64_t file_bytes = std::uint64_t{512} << 20;
  std::uint64_t memory_bytes = std::uint64_t{2} << 30;  ///< of the child process
  unsigned cpu_s = 30;                                  ///< CPU time of the child process
  double wall_s = 60;
};

/// Length of a named unit [m]; nullopt if unknown.
std::optional<double> MetresOfUnit(std::string_view unit);
inline constexpr std::string_view kMeshUnits = "um, mm, cm, m, inch, ft";

/// Number of triangles that a file declares or must at least contain, found without parsing it, so
/// that files that are far too large are refused at once. 0 if unknown.
std::uint64_t AnnouncedTriangles(MeshFormat format, std::span<const std::uint8_t> bytes);

/// Whether a file is truncated in a way that its parser does not detect: PLY by the counts in its
/// header, text STL by its last word. (The parsers detect truncated VRML97, glTF and binary STL; an
/// OBJ file has no end mark.)
bool IsTruncated(MeshFormat format, std::span<const std::uint8_t> bytes);

// Codec of plumbline-mesh's response. A malicious file may have taken over that process, so the
// response is untrusted.

/// Mesh as stored in the file, in the file's unit; may be invalid (see CheckMesh).
struct RawMesh {
  scene::TriangleMesh mesh;
  std::uint64_t other_elements = 0;  ///< number of points and lines, which have no surface
  std::vector<std::string> outside;  ///< references to other files and addresses; never opened
  std::uint64_t outside_count = 0;   ///< number of references; `outside` has the first of them
  /// Largest coordinate before or after any transformation, multiplied by the scale of those that
  /// follow: the parsers compute in single precision.
  double largest_coordinate = 0;
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
