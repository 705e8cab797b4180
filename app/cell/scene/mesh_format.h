// Mesh file formats, units and limits.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

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

}  // namespace plumbline::cell
