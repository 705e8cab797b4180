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

void NoteCoordinates(RawMesh& raw, float x, float y, float z) {
  for (const float value : {x, y, z}) {
    if (std::isfinite(value)) {
      raw.largest_coordinate =
          std::max(raw.largest_coordinate, std::abs(static_cast<double>(value)));
    }
  }
}

void NoteOutside(RawMesh& raw, const std::string& name) {
  if (std::find(raw.outside.begin(), raw.outside.end(), name) != raw.outside.end()) return;
  ++raw.outside_count;
  if (raw.outside.size() < kMaxReferences) raw.outside.push_back(name);
}

}  // namespace plumbline::cell
