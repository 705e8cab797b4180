#include "app/cell/scene/mesh_format.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <utility>

namespace plumbline::cell {
namespace {

constexpr std::uint32_t kGood = 0x324D4C50, kRefused = 0x304D4C50;  // "PLM2", "PLM0"

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
  PutNumber(bytes, answer->largest_coordinate);
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
  raw.largest_coordinate = in.Number<double>();
  if (!(raw.largest_coordinate >= 0)) return std::nullopt;
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

namespace {

constexpr std::array<std::pair<std::string_view, MeshFormat>, 6> kFormatWords = {{
    {"wrl", MeshFormat::kVrml},
    {"stl", MeshFormat::kStl},
    {"obj", MeshFormat::kObj},
    {"ply", MeshFormat::kPly},
    {"gltf", MeshFormat::kGltf},
    {"glb", MeshFormat::kGlb},
}};

constexpr std::array<std::pair<std::string_view, double>, 6> kUnits = {{
    {"um", 1e-6},
    {"mm", 1e-3},
    {"cm", 1e-2},
    {"m", 1},
    {"inch", 0.0254},
    {"ft", 0.3048},
}};

/// Number of lines that start with `word` and a space.
std::uint64_t LinesOf(std::string_view text, std::string_view word) {
  std::uint64_t lines = 0;
  for (std::size_t at = 0; at < text.size();) {
    const auto begin = text.find_first_not_of(" \t\r", at);
    if (begin == std::string_view::npos) break;
    const std::string_view rest = text.substr(begin);
    if (rest.substr(0, word.size()) == word && rest.size() > word.size() &&
        rest[word.size()] == ' ') {
      ++lines;
    }
    const auto end = text.find('\n', begin);
    if (end == std::string_view::npos) break;
    at = end + 1;
  }
  return lines;
}

/// Binary STL: 80 bytes, the count, 50 bytes per triangle. Some files start with "solid" like text
/// files, so the length decides; nullopt if it is a text file.
std::optional<std::uint32_t> BinaryStlTriangles(std::string_view text) {
  constexpr std::size_t kHeader = 84, kEach = 50;
  if (text.size() < kHeader) return std::nullopt;
  std::uint32_t count = 0;
  std::memcpy(&count, text.data() + 80, sizeof count);
  if (text.size() != kHeader + kEach * std::uint64_t{count}) return std::nullopt;
  return count;
}

/// VRML97: counts the faces of every coordIndex, each terminated by -1.
std::uint64_t TrianglesOfVrml(std::string_view text) {
  std::uint64_t faces = 0;
  constexpr std::string_view kKey = "coordIndex";
  for (auto at = text.find(kKey); at != text.npos; at = text.find(kKey, at)) {
    const auto end = std::min(text.find(']', at), text.size());
    for (; at < end; ++at) {
      if (text[at] == '-') ++faces;
    }
  }
  return faces;
}

struct PlyElement {
  bool face = false;
  std::uint64_t count = 0;
  std::uint64_t bytes = 0;  ///< minimum size of one element in a binary file
};

struct PlyHeader {
  bool binary = false;
  std::vector<PlyElement> elements;
  std::string_view body;
};

std::uint64_t BytesOfPlyType(std::string_view type) {
  constexpr std::array<std::pair<std::string_view, std::uint64_t>, 16> kTypes = {{
      {"char", 1},
      {"uchar", 1},
      {"int8", 1},
      {"uint8", 1},
      {"short", 2},
      {"ushort", 2},
      {"int16", 2},
      {"uint16", 2},
      {"int", 4},
      {"uint", 4},
      {"int32", 4},
      {"uint32", 4},
      {"float", 4},
      {"float32", 4},
      {"double", 8},
      {"float64", 8},
  }};
  for (const auto& [known, bytes] : kTypes) {
    if (known == type) return bytes;
  }
  return 1;
}

/// Removes and returns the first word.
std::string_view TakeWord(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(" \t\r"), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(" \t\r"));
  line.remove_prefix(word.size());
  return word;
}

PlyHeader PlyHeaderOf(std::string_view text) {
  PlyHeader header;
  while (!text.empty()) {
    const auto end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == text.npos ? text.size() : end + 1);
    const std::string_view key = TakeWord(line);
    if (key == "end_header") break;
    if (key == "format") header.binary = TakeWord(line) != "ascii";
    if (key == "element") {
      PlyElement element;
      element.face = TakeWord(line) == "face";
      const std::string_view count = TakeWord(line);
      std::from_chars(count.data(), count.data() + count.size(), element.count);
      header.elements.push_back(element);
    }
    if (key == "property" && !header.elements.empty()) {
      PlyElement& element = header.elements.back();
      const std::string_view type = TakeWord(line);
      if (type == "list") {
        element.bytes += BytesOfPlyType(TakeWord(line));
        // A face has at least 3 corners; other lists may be empty.
        const std::uint64_t each = BytesOfPlyType(TakeWord(line));
        if (element.face && TakeWord(line).substr(0, 12) == "vertex_index")
          element.bytes += 3 * each;
      } else {
        element.bytes += BytesOfPlyType(type);
      }
    }
  }
  header.body = text;
  return header;
}

bool PlyIsTruncated(std::string_view text) {
  const PlyHeader header = PlyHeaderOf(text);
  const std::uint64_t size = header.body.size();
  std::uint64_t least = 0;
  for (const PlyElement& element : header.elements) {
    if (element.count > size) return true;  // less than one byte per element
    least += element.count * (header.binary ? element.bytes : 1);
  }
  if (header.binary) return size < least;
  std::uint64_t lines = 0;
  for (std::string_view body = header.body; !body.empty();) {
    const auto end = body.find('\n');
    lines += body.substr(0, end).find_first_not_of(" \t\r") != body.npos ? 1 : 0;
    body.remove_prefix(end == body.npos ? body.size() : end + 1);
  }
  return lines < least;
}

bool StlIsTruncated(std::string_view text) {
  if (text.substr(0, 5) != "solid" || text.find("facet") == text.npos) return false;
  const std::size_t tail = std::min<std::size_t>(text.size(), 4096);
  return text.substr(text.size() - tail).find("endsolid") == text.npos;
}

}  // namespace

std::optional<MeshFormat> MeshFormatOfWord(std::string_view word) {
  for (const auto& [known, format] : kFormatWords) {
    if (known == word) return format;
  }
  return std::nullopt;
}

std::optional<MeshFormat> MeshFormatOfName(std::string_view file) {
  const auto dot = file.rfind('.');
  if (dot == std::string_view::npos) return std::nullopt;
  std::string suffix(file.substr(dot + 1));
  for (char& c : suffix) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return MeshFormatOfWord(suffix);
}

std::string_view WordOf(MeshFormat format) {
  return kFormatWords[static_cast<std::size_t>(format)].first;
}

std::optional<double> MetresOfUnit(std::string_view unit) {
  for (const auto& [known, metres] : kUnits) {
    if (known == unit) return metres;
  }
  return std::nullopt;
}

std::uint64_t AnnouncedTriangles(MeshFormat format, std::span<const std::uint8_t> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  switch (format) {
    case MeshFormat::kStl:
      if (const auto count = BinaryStlTriangles(text)) return *count;
      return LinesOf(text, "facet");
    case MeshFormat::kObj:
      return LinesOf(text, "f");
    case MeshFormat::kPly:
      for (const PlyElement& element : PlyHeaderOf(text).elements) {
        if (element.face) return element.count;
      }
      return 0;
    case MeshFormat::kVrml:
      return TrianglesOfVrml(text);
    case MeshFormat::kGltf:
    case MeshFormat::kGlb:
      break;
  }
  return 0;
}

bool IsTruncated(MeshFormat format, std::span<const std::uint8_t> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (format == MeshFormat::kPly) return PlyIsTruncated(text);
  // A binary STL that starts with "solid" is recognised by its length.
  return format == MeshFormat::kStl && !BinaryStlTriangles(text) && StlIsTruncated(text);
}

}  // namespace plumbline::cell
