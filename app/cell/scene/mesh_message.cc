#include "app/cell/scene/mesh_message.h"

#include <algorithm>
#include <cstring>

namespace plumbline::cell {
namespace {

constexpr std::uint32_t kGood = 0x314D4C50, kRefused = 0x304D4C50;  // "PLM1", "PLM0"

static_assert(sizeof(Vec3f) == 12 && sizeof(scene::Triangle) == 12);

void Put(std::vector<std::uint8_t>& bytes, const void* data, std::size_t size) {
  const auto* from = static_cast<const std::uint8_t*>(data);
  bytes.insert(bytes.end(), from, from + size);
}

template <typename T>
void PutNumber(std::vector<std::uint8_t>& bytes, T number) {
  Put(bytes, &number, sizeof number);
}

void PutText(std::vector<std::uint8_t>& bytes, const std::string& text, std::size_t longest) {
  const auto size = static_cast<std::uint32_t>(std::min(text.size(), longest));
  PutNumber(bytes, size);
  Put(bytes, text.data(), size);
}

/// Reads values from the front; `good` becomes and stays false if there are too few bytes.
struct AnswerBytes {
  std::span<const std::uint8_t> left;
  bool good = true;

  bool Take(void* to, std::size_t size) {
    good = good && size <= left.size();
    if (!good) return false;
    if (size > 0) std::memcpy(to, left.data(), size);
    left = left.subspan(size);
    return true;
  }
  template <typename T>
  T Number() {
    T number{};
    Take(&number, sizeof number);
    return number;
  }
  std::string Text(std::size_t longest) {
    const auto size = Number<std::uint32_t>();
    good = good && size <= longest && size <= left.size();
    if (!good) return {};
    std::string text(size, '?');
    Take(text.data(), size);
    for (char& c : text) c = c >= ' ' && c <= '~' ? c : '?';
    return text;
  }
  /// Fills `a` and `b` with all remaining bytes, which must match their sizes.
  template <typename A, typename B>
  void Fill(std::vector<A>& a, std::uint64_t a_size, std::vector<B>& b, std::uint64_t b_size) {
    good = good && a_size <= left.size() && b_size <= left.size() &&
           left.size() == a_size * sizeof(A) + b_size * sizeof(B);
    if (!good) return;
    a.resize(a_size);
    b.resize(b_size);
    Take(a.data(), a_size * sizeof(A));
    Take(b.data(), b_size * sizeof(B));
  }
};

}  // namespace

std::vector<std::uint8_t> EncodeMeshResponse(const Result<RawMesh>& answer) {
  std::vector<std::uint8_t> bytes;
  if (!answer) {
    PutNumber(bytes, kRefused);
    PutText(bytes, answer.error(), kLongestReason);
    return bytes;
  }
  PutNumber(bytes, kGood);
  PutNumber(bytes, answer->other_elements);
  PutNumber(bytes, answer->outside_count);
  const std::size_t names = std::min(answer->outside.size(), kMaxReferences);
  PutNumber(bytes, static_cast<std::uint32_t>(names));
  for (std::size_t i = 0; i < names; ++i) PutText(bytes, answer->outside[i], kMaxReferenceLength);
  const scene::TriangleMesh& mesh = answer->mesh;
  PutNumber(bytes, std::uint64_t{mesh.vertices_O.size()});
  PutNumber(bytes, std::uint64_t{mesh.triangles.size()});
  bytes.reserve(bytes.size() + 12 * (mesh.vertices_O.size() + mesh.triangles.size()));
  Put(bytes, mesh.vertices_O.data(), mesh.vertices_O.size() * sizeof(Vec3f));
  Put(bytes, mesh.triangles.data(), mesh.triangles.size() * sizeof(scene::Triangle));
  return bytes;
}

std::size_t MaxMeshResponseBytes(const MeshLimits& limits) {
  return limits.triangles * (sizeof(scene::Triangle) + 3 * sizeof(Vec3f)) +
         kMaxReferences * (kMaxReferenceLength + 4) + kLongestReason + 64;
}

std::optional<Result<RawMesh>> DecodeMeshResponse(std::span<const std::uint8_t> bytes,
                                                  const MeshLimits& limits) {
  AnswerBytes in{bytes};
  const auto kind = in.Number<std::uint32_t>();
  if (kind == kRefused) {
    const std::string why = in.Text(kLongestReason);
    if (!in.good || !in.left.empty() || why.empty()) return std::nullopt;
    return Error{why};
  }
  if (kind != kGood) return std::nullopt;
  RawMesh raw;
  raw.other_elements = in.Number<std::uint64_t>();
  raw.outside_count = in.Number<std::uint64_t>();
  const auto names = in.Number<std::uint32_t>();
  if (!in.good || names > kMaxReferences || names > raw.outside_count) return std::nullopt;
  for (std::uint32_t i = 0; i < names; ++i) raw.outside.push_back(in.Text(kMaxReferenceLength));
  const auto vertices = in.Number<std::uint64_t>();
  const auto triangles = in.Number<std::uint64_t>();
  if (triangles > limits.triangles || vertices > 3 * limits.triangles) return std::nullopt;
  in.Fill(raw.mesh.vertices_O, vertices, raw.mesh.triangles, triangles);
  if (!in.good) return std::nullopt;
  return raw;
}

}  // namespace plumbline::cell
