#include "app/cell/scene/mesh_parser.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace plumbline::cell {

Result<RawMesh> ParseMesh(MeshFormat format, std::span<const std::uint8_t> bytes,
                          std::uint64_t most_triangles) {
  const std::uint64_t announced = AnnouncedTriangles(format, bytes);
  if (announced > most_triangles) return TooManyTriangles(announced, most_triangles);
  if (IsTruncated(format, bytes)) {
    return Error{"the file is truncated: copy or export it again"};
  }
  return format == MeshFormat::kVrml ? ParseVrml(bytes, most_triangles)
                                     : ParseWithAssimp(format, bytes, most_triangles);
}

Error TooManyTriangles(std::uint64_t count, std::uint64_t most) {
  return Error{
      fmt::format("at least {} triangles; the limit is {}: simplify the model, or export it with a "
                  "coarser mesh",
                  count, most)};
}

void NoteCoordinates(RawMesh& raw, const Vec3f& p) {
  for (const float value : p) {
    if (std::isfinite(value)) {
      raw.largest_coordinate =
          std::max(raw.largest_coordinate, std::abs(static_cast<double>(value)));
    }
  }
}

bool AddReference(std::vector<std::string>& references, const std::string& name) {
  if (std::find(references.begin(), references.end(), name) != references.end()) return false;
  if (references.size() < kMaxReferences) references.push_back(name);
  return true;
}

void NoteOutside(RawMesh& raw, const std::string& name) {
  if (AddReference(raw.outside, name)) ++raw.outside_count;
}

}  // namespace plumbline::cell
