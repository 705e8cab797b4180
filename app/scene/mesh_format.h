// What a mesh file may be, and how much of it is looked at.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace plumbline {

enum class MeshFormat { kVrml, kStl, kObj, kPly, kGltf, kGlb };

/// By the name's suffix, in either case; nothing for any other.
std::optional<MeshFormat> MeshFormatOfName(std::string_view file);
std::optional<MeshFormat> MeshFormatOfWord(std::string_view word);  ///< "wrl", "stl", ...
std::string_view WordOf(MeshFormat format);                         ///< the suffix
inline constexpr std::string_view kMeshFormats = ".wrl, .stl, .obj, .ply, .gltf, .glb";

/// The reader ends where one of them is passed, and says which.
struct MeshLimits {
  std::uint64_t triangles = 2'000'000;
  std::uint64_t file_bytes = std::uint64_t{512} << 20;
  std::uint64_t memory_bytes = std::uint64_t{2} << 30;  ///< of the reading process
  unsigned cpu_s = 30;                                  ///< of the reading process
  double wall_s = 60;
};

/// Millimetres and the like: the factor to metres; nothing for any other word.
std::optional<double> MetresOfUnit(std::string_view unit);
inline constexpr std::string_view kMeshUnits = "um, mm, cm, m, inch, ft";

/// A number of triangles that a file has at least, or says it has, found without reading it
/// properly: what is far too large is refused by it in a moment. 0 where nothing can be said.
std::uint64_t AnnouncedTriangles(MeshFormat format, std::span<const std::uint8_t> bytes);

/// Whether the end of a file is missing, where its reader would not notice: PLY by the counts of
/// its header, STL text by its last word. (VRML97, glTF and binary STL are refused by their
/// readers; an OBJ has no end.)
bool IsTruncated(MeshFormat format, std::span<const std::uint8_t> bytes);

}  // namespace plumbline
