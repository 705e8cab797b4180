// Meshes and models of CAD.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstring>

#include "app/base/recognition/kinds.h"
#include "app/base/text/vrml_tokens.h"

namespace plumbline::recognition {
namespace {

std::optional<Fact> FirstLine(const Outline& file, std::string_view start) {
  if (file.head().empty() || !StartsWith(file.head().front().text, start)) return std::nullopt;
  return Shown(&file.head().front());
}

std::optional<Fact> RootOf(const Outline& file, std::string_view root) {
  if (file.syntax() != Syntax::kXml || file.entries().empty()) return std::nullopt;
  return InLowerCase(file.entries().front().path) == root
             ? std::optional(Fact{"", fmt::format("<{}>", file.entries().front().path),
                                  file.entries().front().line})
             : std::nullopt;
}

void UnitIsOpen(const Outline& /*file*/, Recognition& found) {
  found.undecided.emplace_back("the unit of length; the format states none: give --unit");
}

/// Contradicts if braces and brackets do not close.
void CheckBraces(const Outline& file, Recognition& found) {
  std::int64_t open = 0;
  text::VrmlTokens tokens(file.text());
  for (text::VrmlToken token = tokens.Next(); !token.at_end(); token = tokens.Next()) {
    open += token.depth();
  }
  if (open > 0) {
    Contradict(found, "end", fmt::format("{} brackets are still open: the file is cut", open),
               file.line_count());
  } else if (open < 0) {
    Contradict(found, "brackets", "close more often than they open: the file is damaged");
  }
}

void ReadVrml(const Outline& file, Recognition& found) {
  const std::string_view text = file.text();
  const std::size_t sets = CountIn(text, "IndexedFaceSet");
  AddFact(found, "face sets", fmt::format("{}", sets));
  constexpr std::size_t kMostNamed = 8;
  for (const text::VrmlReference& one : text::VrmlReferences(text, kMostNamed)) {
    Contradict(
        found, "other files",
        fmt::format("{} \"{}\": what that file holds is missing here", one.node, Quoted(one.file)),
        file.LineAt(one.at));
  }
  CheckBraces(file, found);
  UnitIsOpen(file, found);
  if (found.kind == "vrml97")
    found.undecided.back() =
        "the unit of length; VRML97 means m, but few exporters keep to it: give --unit";
}

constexpr std::size_t kStlHead = 84, kStlFacet = 50;

std::uint32_t StlCount(std::string_view bytes) {
  std::uint32_t count = 0;
  if (bytes.size() >= kStlHead) std::memcpy(&count, bytes.data() + kStlHead - 4, sizeof count);
  return count;
}

std::optional<Fact> IsBinaryStl(const Outline& file) {
  const std::string_view bytes = file.bytes();
  if (bytes.size() < kStlHead) return std::nullopt;
  const std::uint32_t count = StlCount(bytes);
  const std::uint64_t size = kStlHead + kStlFacet * std::uint64_t{count};
  if (count > 0 && size == bytes.size()) {
    return Fact{"", fmt::format("80 bytes, the count {}, and 50 bytes for each", count), 0};
  }
  // A cut one is known by its name only.
  if (file.extension() == "stl" && file.syntax() == Syntax::kBinary) {
    return Fact{"", "the name, and bytes that are no text", 0};
  }
  return std::nullopt;
}

void ReadBinaryStl(const Outline& file, Recognition& found) {
  const std::uint32_t count = StlCount(file.bytes());
  AddFact(found, "triangles", fmt::format("{}", count));
  const std::uint64_t size = kStlHead + kStlFacet * std::uint64_t{count};
  if (size != file.bytes().size()) {
    Contradict(found, "size",
               fmt::format("{} triangles need {} bytes, the file has {}: it is cut or damaged",
                           count, size, file.bytes().size()));
  }
  UnitIsOpen(file, found);
}

std::optional<Fact> IsTextStl(const Outline& file) {
  const Line* const facet = file.FindLine("facet normal");
  const bool solid = FirstLine(file, "solid").has_value();
  if (!solid || (facet == nullptr && file.FindLine("endsolid") == nullptr)) return std::nullopt;
  return Shown(&file.head().front());
}

void ReadTextStl(const Outline& file, Recognition& found) {
  const std::string_view text = file.text();
  const std::size_t facets = CountIn(text, "facet normal");
  AddFact(found, "triangles", fmt::format("{}", facets));
  if (CountIn(text, "endfacet") != facets || text.find("endsolid") == std::string_view::npos) {
    Contradict(found, "end", "endsolid is missing, or a facet does not end: the file is cut",
               file.line_count());
  }
  UnitIsOpen(file, found);
}

std::optional<Fact> IsObj(const Outline& file) {
  if (file.syntax() == Syntax::kBinary || file.syntax() == Syntax::kXml) return std::nullopt;
  const Line* const vertex = file.FindLine("v ");
  if (vertex == nullptr) return std::nullopt;
  std::size_t known = 0, all = 0;
  for (const Line& line : file.head()) {
    if (line.text.front() == '#') continue;
    ++all;
    const std::string_view word = line.text.substr(0, line.text.find_first_of(" \t"));
    for (const std::string_view one :
         {"v", "vn", "vt", "vp", "f", "l", "o", "g", "s", "p", "mtllib", "usemtl"}) {
      known += word == one ? 1 : 0;
    }
  }
  // A list of points may have "v" for names.
  const bool faces =
      file.extension() == "obj" || file.text().find("\nf ") != std::string_view::npos;
  return faces && known * 10 >= all * 9 ? Shown(vertex) : std::nullopt;
}

/// Contradicts the first face with a vertex that the file does not have.
void CheckFaces(const Outline& file, std::size_t vertices, Recognition& found) {
  const std::string_view text = file.text();
  for (std::size_t at = text.starts_with("f ") ? 0 : text.find("\nf "); at < text.size();
       at = text.find("\nf ", at + 1)) {
    const std::size_t start = at + (text[at] == '\n' ? 3 : 2);
    const std::string_view line = text.substr(start, text.find('\n', start) - start);
    for (std::size_t word = line.find_first_not_of(" \t\r"); word < line.size();
         word = line.find_first_not_of(" \t\r", line.find_first_of(" \t\r", word))) {
      std::int64_t index = 0;
      const auto [end, fault] =
          std::from_chars(line.data() + word, line.data() + line.size(), index);
      const std::uint64_t size =
          index < 0 ? 0 - static_cast<std::uint64_t>(index) : static_cast<std::uint64_t>(index);
      if (fault == std::errc::invalid_argument) break;
      if (fault == std::errc() && size > 0 && size <= vertices) continue;
      Contradict(
          found, "face",
          fmt::format("vertex {} does not exist: the file has {}",
                      Quoted(line.substr(word, static_cast<std::size_t>(end - line.data()) - word)),
                      vertices),
          file.LineAt(start));
      return;
    }
  }
}

void ReadObj(const Outline& file, Recognition& found) {
  const std::string_view text = file.text();
  const auto lines = [&](std::string_view start) {
    const std::string with_end = "\n" + std::string(start);
    return CountIn(text, with_end) + (text.starts_with(start) ? 1 : 0);
  };
  const std::size_t vertices = lines("v ");
  AddFact(found, "vertices", fmt::format("{}", vertices));
  AddFact(found, "faces", fmt::format("{}", lines("f ")));
  CheckFaces(file, vertices, found);
  UnitIsOpen(file, found);
}

/// Lines of the header of a PLY, which may be followed by binary data.
void ReadPly(const Outline& file, Recognition& found) {
  std::string_view rest = file.bytes().substr(0, 16 * 1024);
  bool ended = false;
  for (int line = 1; !rest.empty(); ++line) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view text = Trimmed(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (text.starts_with("format ")) AddFact(found, "format", Quoted(text.substr(7)), line);
    if (text.starts_with("element ")) AddFact(found, "element", Quoted(text.substr(8)), line);
    ended = text == "end_header";
    if (ended) break;
  }
  if (!ended) Contradict(found, "header", "end_header is missing: the file is cut");
  UnitIsOpen(file, found);
}

std::optional<Fact> IsGltf(const Outline& file) {
  if (file.syntax() != Syntax::kBraces) return std::nullopt;
  const Entry* const version = file.Find("asset.version");
  const bool gltf = version != nullptr && (file.FindName("primitives.mode") != nullptr ||
                                           file.text().find("\"meshes\"") != std::string::npos ||
                                           file.text().find("\"scenes\"") != std::string::npos);
  return gltf ? Shown(version) : std::nullopt;
}

std::optional<Fact> IsIges(const Outline& file) {
  // Fixed columns: section letter in column 73, then a number.
  constexpr std::size_t kSection = 72;
  const std::string_view text =
      file.text().substr(0, std::min<std::size_t>(100, file.text().size()));
  const std::size_t end = text.find_first_of("\r\n");
  if (end == std::string_view::npos || end < kSection + 2 || end > 80) return std::nullopt;
  const std::string_view number = text.substr(kSection + 1, end - kSection - 1);
  if (text[kSection] != 'S' || number.find_first_not_of(" 0123456789") != std::string_view::npos) {
    return std::nullopt;
  }
  return Fact{"", "section letter S in column 73", 1};
}

constexpr const char *kCheck = "plumbline mesh check {} --unit UNIT",
                     *kExport = "Export it as STL, OBJ or VRML97 from the program that made it.";

constexpr std::array kMeshKinds = {
    Kind{"vrml97", "a mesh in VRML97 (VRML 2.0)", Content::kMesh,
         [](const Outline& file) { return FirstLine(file, "#VRML V2.0"); }, ReadVrml, kCheck, ""},
    Kind{"vrml1", "a mesh in VRML 1.0", Content::kMeshOfOthers,
         [](const Outline& file) { return FirstLine(file, "#VRML V1.0"); }, ReadVrml, "", kExport},
    Kind{"open-inventor", "a mesh in Open Inventor", Content::kMeshOfOthers,
         [](const Outline& file) {
           const auto line = FirstLine(file, "#Inventor V");
           return line ? line : FirstBytes(file, "#Inventor V", "#Inventor V");
         },
         ReadVrml, "", kExport},
    Kind{"x3d", "a scene in X3D", Content::kMeshOfOthers,
         [](const Outline& file) {
           const auto root = RootOf(file, "x3d");
           return root ? root : FirstLine(file, "#X3D ");
         },
         nullptr, "", kExport},
    Kind{"stl-text", "a mesh in STL (text)", Content::kMesh, IsTextStl, ReadTextStl, kCheck, ""},
    Kind{"ply", "a mesh in PLY", Content::kMesh,
         [](const Outline& file) -> std::optional<Fact> {
           const std::string_view bytes = file.bytes();
           if (!bytes.starts_with("ply\n") && !bytes.starts_with("ply\r\n")) return std::nullopt;
           return Fact{"", "ply", 1};
         },
         ReadPly, kCheck, ""},
    Kind{"glb", "a mesh in glTF (binary)", Content::kMesh,
         [](const Outline& file) { return FirstBytes(file, "glTF", "glTF"); },
         [](const Outline& file, Recognition& found) {
           std::uint32_t size = 0;
           if (file.bytes().size() >= 12) std::memcpy(&size, file.bytes().data() + 8, sizeof size);
           if (size > file.bytes().size()) {
             Contradict(found, "size",
                        fmt::format("the header states {} bytes, the file has {}: it is cut", size,
                                    file.bytes().size()));
           }
           AddFact(found, "unit", "m (glTF)");
         },
         kCheck, ""},
    Kind{"gltf", "a mesh in glTF (text)", Content::kMesh, IsGltf,
         [](const Outline& file, Recognition& found) {
           AddValue(file, "asset.generator", "made by", found);
           AddFact(found, "unit", "m (glTF)");
         },
         kCheck, ""},
    Kind{"collada", "a scene in COLLADA (.dae)", Content::kMeshOfOthers,
         [](const Outline& file) { return RootOf(file, "collada"); },
         [](const Outline& file, Recognition& found) {
           AddValue(file, "COLLADA@version", "version", found);
           AddValue(file, "COLLADA.asset.unit@meter", "unit [m]", found);
           AddValue(file, "COLLADA.asset.up_axis", "up axis", found);
         },
         "", kExport},
    Kind{"step", "a solid model in STEP", Content::kMeshOfOthers,
         [](const Outline& file) { return FirstLine(file, "ISO-10303-21"); },
         [](const Outline& file, Recognition& found) {
           if (const Line* const schema = file.FindLine("FILE_SCHEMA")) {
             AddFact(found, "schema", Quoted(schema->text), schema->number);
           }
           if (file.text().find("END-ISO-10303-21") == std::string::npos) {
             Contradict(found, "end", "END-ISO-10303-21 is missing: the file is cut",
                        file.line_count());
           }
         },
         "",
         "It has surfaces, no triangles: export it as STL, OBJ or VRML97 from CAD, or with "
         "FreeCAD or gmsh."},
    Kind{"iges", "a surface model in IGES", Content::kMeshOfOthers, IsIges, nullptr, "", kExport},
    Kind{"fbx", "a scene in FBX", Content::kMeshOfOthers,
         [](const Outline& file) {
           const auto magic = FirstBytes(file, "Kaydara FBX Binary", "Kaydara FBX Binary");
           return magic ? magic : FirstLine(file, "; FBX ");
         },
         nullptr, "", kExport},
    Kind{"off", "a mesh in OFF", Content::kMeshOfOthers,
         [](const Outline& file) -> std::optional<Fact> {
           const bool off = !file.head().empty() && (file.head().front().text == "OFF" ||
                                                     file.head().front().text == "COFF");
           return off ? Shown(&file.head().front()) : std::nullopt;
         },
         nullptr, "", kExport},
    Kind{"pcd", "a point cloud (PCD)", Content::kMeshOfOthers,
         [](const Outline& file) -> std::optional<Fact> {
           const auto magic = FirstBytes(file, "# .PCD", "# .PCD");
           return magic ? magic : FirstLine(file, "VERSION .7");
         },
         nullptr, "", "A mesh is needed: reconstruct the surface, and export it as STL or PLY."},
    Kind{"dxf", "a drawing in DXF", Content::kMeshOfOthers,
         [](const Outline& file) -> std::optional<Fact> {
           const auto& head = file.head();
           if (head.size() < 2 || head[0].text != "0" || head[1].text != "SECTION") {
             return std::nullopt;
           }
           return Shown(&head[1]);
         },
         nullptr, "", kExport},
    Kind{"stl-binary", "a mesh in STL (binary)", Content::kMesh, IsBinaryStl, ReadBinaryStl, kCheck,
         ""},
    Kind{"obj", "a mesh in OBJ (Wavefront)", Content::kMesh, IsObj, ReadObj, kCheck, ""},
};

}  // namespace

std::span<const Kind> MeshKinds() {
  return kMeshKinds;
}

}  // namespace plumbline::recognition
