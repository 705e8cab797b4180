#include "app/base/recognition/recognition.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <set>

#include "app/base/recognition/kinds.h"
#include "app/base/recognition/outline.h"
#include "app/base/text/json_text.h"
#include "app/base/text/text.h"

namespace plumbline::recognition {
namespace {

/// The name in a command line.
std::string ShellWord(std::string_view name) {
  const bool plain = std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("/._-+,=@%").find(c) != std::string_view::npos;
  });
  if (plain && !name.empty()) return std::string(name);
  std::string quoted = "'";
  for (const char c : name) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string WithFile(std::string_view text, std::string_view name) {
  std::string filled;
  for (std::size_t at = text.find("{}"); at != std::string_view::npos; at = text.find("{}")) {
    filled.append(text.substr(0, at)).append(ShellWord(name));
    text.remove_prefix(at + 2);
  }
  return filled.append(text);
}

/// What a name ends in, where the content shows nothing.
struct Ending {
  std::string_view extension, name;
};
constexpr std::array kEndings = {
    Ending{"urdf", "a description of a robot (URDF)"},
    Ending{"xacro", "a URDF with xacro"},
    Ending{"wrl", "a mesh in VRML"},
    Ending{"stl", "a mesh in STL"},
    Ending{"obj", "a mesh in OBJ"},
    Ending{"ply", "a mesh in PLY"},
    Ending{"gltf", "a mesh in glTF"},
    Ending{"glb", "a mesh in glTF (binary)"},
    Ending{"dae", "a scene in COLLADA (.dae)"},
    Ending{"step", "a solid model in STEP"},
    Ending{"stp", "a solid model in STEP"},
    Ending{"igs", "a surface model in IGES"},
    Ending{"iges", "a surface model in IGES"},
    Ending{"cameramodel", "a camera model of mrcal (.cameramodel)"},
    Ending{"src", "a program of a KUKA controller (KRL)"},
    Ending{"mod", "a program of an ABB controller (RAPID)"},
    Ending{"ls", "a program of a FANUC controller (TP, .ls)"},
    Ending{"tp", "a compiled program of a FANUC controller (.tp)"},
    Ending{"jbi", "a job of a Yaskawa controller (.JBI)"},
    Ending{"script", "a program of a Universal Robots controller (URScript)"},
    Ending{"urp", "a program of a Universal Robots controller (.urp, gzip)"},
    Ending{"installation", "an installation of a Universal Robots controller"},
    Ending{"bag", "a recording of ROS 1 (.bag)"},
    Ending{"ifc", "a model of a building (IFC)"},
    Ending{"x_t", "a solid model in Parasolid"},
    Ending{"jt", "a model in JT"},
    Ending{"prt", "a part of a CAD program"},
    Ending{"catpart", "a part of CATIA"},
};

std::string UnknownName(const Outline& file) {
  switch (file.syntax()) {
    case Syntax::kXml:
      return file.entries().empty()
                 ? "XML or HTML without an element"
                 : fmt::format("XML with the root <{}>, which Plumbline does not know",
                               Quoted(file.entries().front().path));
    case Syntax::kBraces:
      return "JSON, or a text in braces, of a kind that Plumbline does not know";
    case Syntax::kYaml:  // any text with colons looks like it
      if (!file.extension().starts_with("y")) break;
      return "YAML of a kind that Plumbline does not know";
    case Syntax::kToml:
      if (file.extension() != "toml" && file.extension() != "ini") break;
      return "TOML or INI of a kind that Plumbline does not know";
    case Syntax::kBinary:
      return "a binary file of a kind that Plumbline does not know";
    default:
      break;
  }
  return "a text of a kind that Plumbline does not know";
}

/// Starts of files that come at the start of a line only.
constexpr std::array<std::string_view, 10> kStarts = {
    "<?xml ", "%YAML:",  "#VRML V", "#Inventor V", "ISO-10303-21;",
    "/PROG ", "&ACCESS", "MODULE ", "/JOB",        "%PDF-"};
/// Keys that a file has once.
constexpr std::array<std::string_view, 8> kSingleKeys = {
    "camera_matrix.rows", "image_width", "kinematics.shoulder.x", "kinematics.joint1.x", "schema",
    "target_type",        "cell",        "cam0.camera_model"};

/// Where the first line comes again, if it is one of words rather than of data; npos if it does
/// not.
std::size_t RepeatOfFirstLine(const Outline& file) {
  constexpr std::size_t kShortest = 8;
  if (file.head().empty()) return std::string_view::npos;
  const std::string_view first = file.head().front().text;
  const auto letters = std::ranges::count_if(
      first, [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); });
  const bool words =
      first.size() >= kShortest && letters * 2 >= static_cast<std::int64_t>(first.size());
  // Items of lists and facets look alike.
  const bool item = first.starts_with("-") || first.starts_with("[[") || first.starts_with("solid");
  if (!words || item) return std::string_view::npos;
  const std::string_view text = file.text();
  const std::string line = fmt::format("\n{}", first);
  for (std::size_t at = text.find(line); at != std::string_view::npos;
       at = text.find(line, at + 1)) {
    const std::size_t end = at + line.size();
    if (end == text.size() || text[end] == '\n' || text[end] == '\r') return at + 1;
  }
  return std::string_view::npos;
}

/// Two files in one, and an end in the middle of something.
void CheckWhole(const Outline& file, Recognition& found) {
  const std::string_view text = file.text();
  for (std::size_t at = text.find('\n'); at != std::string_view::npos;
       at = text.find('\n', at + 1)) {
    const std::string_view line = text.substr(at + 1, 16);
    if (line.empty() || std::string_view("<%#I/&M").find(line.front()) == std::string_view::npos) {
      continue;
    }
    const auto start =
        std::ranges::find_if(kStarts, [&](std::string_view one) { return line.starts_with(one); });
    if (start == kStarts.end()) continue;
    Contradict(found, "second start",
               fmt::format("{} here: two files in one, or lines before its start", Quoted(*start)),
               file.LineAt(at + 1));
    break;
  }
  // A header of TOML comes once; so does a line of words at the top.
  std::set<std::string_view> headers;
  for (const Entry& entry : file.entries()) {
    const bool header = file.syntax() == Syntax::kToml && entry.value.starts_with("[") &&
                        !entry.value.starts_with("[[") && entry.value.ends_with("]") &&
                        entry.value.find(entry.path) == 1;
    if (!header || headers.insert(entry.path).second) continue;
    Contradict(found, "header twice", fmt::format("[{}]: two files in one", Quoted(entry.path)),
               entry.line);
    break;
  }
  const std::size_t again =
      found.content == Content::kUnknown ? std::string_view::npos : RepeatOfFirstLine(file);
  if (again != std::string_view::npos) {
    Contradict(found, "second start",
               fmt::format("\"{}\" of line {} comes again: two files in one",
                           Quoted(file.head().front().text), file.head().front().number),
               file.LineAt(again));
  }
  std::size_t roots = 0;
  for (const Entry& entry : file.entries()) {
    const bool root =
        file.syntax() == Syntax::kXml && entry.path.find_first_of(".@") == std::string::npos;
    roots += root ? 1 : 0;
    if (roots < 2) continue;
    Contradict(found, "second root", fmt::format("<{}>: two files in one", Quoted(entry.path)),
               entry.line);
    break;
  }
  if (file.syntax() == Syntax::kYaml || file.syntax() == Syntax::kToml) {
    for (const std::string_view key : kSingleKeys) {
      if (file.Count(key) < 2) continue;
      const auto& all = file.entries();
      const auto last = std::find_if(all.rbegin(), all.rend(),
                                     [&](const Entry& entry) { return entry.path == key; });
      Contradict(found, "key twice", fmt::format("{} is given twice: two files in one", key),
                 last->line);
      break;
    }
  }
  const bool known =
      std::ranges::find(found.contradictions, "end", &Fact::what) != found.contradictions.end();
  if (!file.open_at_end().empty() && !file.entries_cut() && !known) {
    Contradict(found, "end", fmt::format("the file ends within {}: it is cut", file.open_at_end()),
               file.line_count());
  }
  if (!file.text_after().empty()) {
    Contradict(found, "end",
               fmt::format("more follows after the last brace: {}", Quoted(file.text_after())),
               file.line_after());
  }
}

/// A mesh is read by what its name ends in.
void CheckEnding(const Outline& file, Recognition& found) {
  struct MeshEnding {
    std::string_view kind;
    std::string_view ending;
  };
  constexpr std::array kMeshes = {MeshEnding{"vrml97", "wrl"},
                                  MeshEnding{"vrml1", "wrl"},
                                  MeshEnding{"open-inventor", "wrl"},
                                  MeshEnding{"stl-text", "stl"},
                                  MeshEnding{"stl-binary", "stl"},
                                  MeshEnding{"obj", "obj"},
                                  MeshEnding{"ply", "ply"},
                                  MeshEnding{"gltf", "gltf"},
                                  MeshEnding{"glb", "glb"}};
  const auto known = std::ranges::find(kMeshes, found.kind, &MeshEnding::kind);
  if (known == kMeshes.end() || known->ending == file.extension()) return;
  Contradict(found, "name",
             fmt::format("ends in .{}, and the name selects the reader: rename it to .{}",
                         Quoted(file.extension()), known->ending));
}

void CheckEncoding(const Outline& file, Recognition& found) {
  if (file.encoding().empty() || file.encoding() == "UTF-8") return;
  AddFact(found, "encoding", file.encoding());
  const bool decoded = found.content == Content::kTable || found.content == Content::kExport;
  if (file.encoding() == "UTF-16" && !decoded) {
    found.conversion =
        "It is in UTF-16, which only import reads: iconv -f UTF-16 -t UTF-8 {} > NEW";
    found.command.clear();
  }
}

void RecogniseByName(const Outline& file, Recognition& found) {
  found.kind = "unknown";
  found.name = UnknownName(file);
  const auto ending = std::ranges::find(kEndings, file.extension(), &Ending::extension);
  if (ending == kEndings.end()) {
    std::vector<std::string> keys;
    constexpr std::size_t kMostKeys = 8;
    for (const Entry& entry : file.entries()) {
      const std::string key = Quoted(entry.path.substr(0, entry.path.find_first_of(".@")));
      if (std::ranges::find(keys, key) == keys.end() && !key.empty()) keys.push_back(key);
      if (keys.size() == kMostKeys) break;
    }
    if (!keys.empty()) {
      AddFact(found, "keys", fmt::format("{}", fmt::join(keys, ", ")), file.entries().front().line);
    } else if (!file.head().empty()) {
      AddFact(found, "first line", Quoted(file.head().front().text), file.head().front().number);
    }
    found.conversion =
        "Nothing in it shows a kind that Plumbline knows; check that it is the right file, whole "
        "and not encrypted.";
    return;
  }
  found.certainty = Certainty::kName;
  found.evidence = {"name", fmt::format("the name ends in .{}", ending->extension), 0};
  found.candidates = {std::string(ending->name), found.name};
  found.name = ending->name;
  found.conversion =
      "Only its name says so, the content does not: it may be cut, damaged or misnamed. Copy it "
      "again.";
}

}  // namespace

Recognition Recognise(std::string_view bytes, std::string_view name) {
  const Outline file(bytes, name);
  Recognition found;
  found.file = std::string(name);
  const Kind* kind = nullptr;
  for (const Kind& one : AllKinds()) {
    const auto shown = one.shown(file);
    if (!shown) continue;
    if (kind == nullptr) {
      kind = &one;
      found.evidence = *shown;
      continue;
    }
    // A table may look like anything, and lens files share their keys.
    const bool expanded = one.content == Content::kDescription && kind->id == "xacro";
    const bool other = !expanded && one.content != kind->content &&
                       one.content != Content::kTable && one.content != Content::kExport &&
                       one.content != Content::kConfiguration &&
                       one.content != Content::kContainer && one.content != Content::kBoard &&
                       kind->content != Content::kTable && kind->content != Content::kExport &&
                       file.syntax() != Syntax::kBinary;
    if (other) {
      Contradict(found, "also", fmt::format("looks like {}", one.name), shown->line);
      break;
    }
  }
  if (kind == nullptr) {
    RecogniseByName(file, found);
  } else {
    found.kind = kind->id;
    found.name = kind->name;
    found.content = kind->content;
    found.certainty = Certainty::kShown;
    found.command = kind->command;
    found.conversion = kind->conversion;
    if (kind->read != nullptr) kind->read(file, found);
    CheckEnding(file, found);
  }
  CheckEncoding(file, found);
  CheckWhole(file, found);
  found.command = WithFile(found.command, name);
  found.conversion = WithFile(found.conversion, name);
  return found;
}

namespace {

std::string LineText(int line) {
  return line > 0 ? fmt::format("line {}", line) : std::string();
}

std::string_view CertaintyWord(Certainty certainty) {
  constexpr std::array<std::string_view, 4> kWords = {"shown", "name", "undecided", "unknown"};
  return kWords.at(static_cast<std::size_t>(certainty));
}

nlohmann::ordered_json JsonOfFacts(const std::vector<Fact>& facts) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const Fact& fact : facts) {
    json.push_back({{"what", fact.what}, {"value", fact.value}});
    if (fact.line > 0) json.back()["line"] = fact.line;
  }
  return json;
}

}  // namespace

std::string TextOf(const Recognition& found) {
  const std::string place =
      found.evidence.line > 0
          ? fmt::format("line {}: {}", found.evidence.line, found.evidence.value)
          : found.evidence.value;
  const char* const doubt = found.certainty == Certainty::kName ? "perhaps " : "";
  std::string text = fmt::format("{}: {}{}{}\n", text::Visible(found.file), doubt, found.name,
                                 place.empty() ? "" : fmt::format(" ({})", place));
  if (found.candidates.size() > 1) {
    text += fmt::format("  undecided: {}\n", fmt::join(found.candidates, ", or "));
  }
  std::size_t width = 0;
  for (const Fact& fact : found.facts) width = std::max(width, fact.what.size());
  for (const Fact& fact : found.facts) {
    text += fmt::format("  {:<{}}  {}{}\n", fact.what, width, fact.value,
                        fact.line > 0 ? fmt::format("  [{}]", LineText(fact.line)) : "");
  }
  for (const Fact& fact : found.contradictions) {
    text += fmt::format("  contradiction: {}{}: {}\n",
                        fact.line > 0 ? LineText(fact.line) + ", " : "", fact.what, fact.value);
  }
  for (const std::string& open : found.undecided) text += fmt::format("  not stated: {}\n", open);
  if (!found.command.empty()) {
    const char* const settled = found.contradictions.empty() ? "" : ", once that is settled";
    text += fmt::format("  use{}: {}\n", settled, found.command);
  }
  if (!found.conversion.empty()) text += fmt::format("  to do: {}\n", found.conversion);
  return text;
}

std::string JsonOf(const std::vector<Recognition>& files) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Recognition& found : files) {
    nlohmann::ordered_json json = {{"file", found.file},
                                   {"kind", found.kind},
                                   {"name", found.name},
                                   {"certainty", CertaintyWord(found.certainty)},
                                   {"shown_by", found.evidence.value}};
    if (found.evidence.line > 0) json["line"] = found.evidence.line;
    json["candidates"] = found.candidates;
    json["facts"] = JsonOfFacts(found.facts);
    json["contradictions"] = JsonOfFacts(found.contradictions);
    json["not_stated"] = found.undecided;
    json["command"] = nullptr;
    json["to_do"] = nullptr;
    if (!found.command.empty()) json["command"] = found.command;
    if (!found.conversion.empty()) json["to_do"] = found.conversion;
    list.push_back(std::move(json));
  }
  return text::JsonText(nlohmann::ordered_json{{"schema", 1}, {"files", std::move(list)}}, 2) +
         "\n";
}

}  // namespace plumbline::recognition
