// Fuzzer: arbitrary bytes as the answer of the mesh process: a mesh, a reason, or no answer.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "app/cell/scene/mesh_format.h"
#include "firmware-like/scene/mesh_facts.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plumbline;
  const cell::MeshLimits limits{.triangles = 100};
  const auto answer = cell::DecodeMeshResponse({data, size}, limits);
  if (!answer) return 0;
  if (size > cell::MaxMeshResponseBytes(limits)) std::abort();
  if (!*answer) {
    if (answer->error().empty()) std::abort();
    return 0;
  }
  // A complete answer encodes to the same bytes, unless a text contained unprintable characters.
  if (cell::EncodeMeshResponse(*answer).size() != size) std::abort();
  cell::RawMesh raw = answer->value();
  const auto checked = scene::CheckMesh(std::move(raw.mesh), 1e-3);
  if (!checked) return 0;
  const scene::MeshFacts& facts = checked->facts;
  if (facts.triangles == 0 || facts.parts == 0 || facts.ends.empty()) std::abort();
  for (const Vec3f& p : checked->mesh.vertices_O) {
    if (!p.allFinite()) std::abort();
  }
  for (const scene::Triangle& triangle : checked->mesh.triangles) {
    for (const std::uint32_t i : triangle) {
      if (i >= facts.vertices) std::abort();
    }
  }
  return 0;
}
