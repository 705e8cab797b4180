// Plumbline's own text files.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "app/base/recognition/kinds.h"

namespace plumbline::recognition {
namespace {

/// The first of these keys of TOML, wherever it is in the file.
const Entry* FirstOf(const Outline& file, std::initializer_list<std::string_view> paths) {
  if (file.syntax() != Syntax::kToml) return nullptr;
  for (const std::string_view path : paths) {
    for (const Entry& entry : file.entries()) {
      const bool within = entry.path.size() > path.size() && entry.path.starts_with(path) &&
                          entry.path[path.size()] == '.';
      if (within || entry.path == path) return &entry;
    }
  }
  return nullptr;
}

/// A list of tables: [[read]]. Other programs have single tables of these names.
const Entry* TomlListOf(const Outline& file, std::string_view path) {
  const Entry* const entry = FirstOf(file, {path});
  const bool is_list = entry != nullptr && entry->path == path && entry->value.starts_with("[[");
  return is_list ? entry : nullptr;
}

std::optional<Fact> KeyOf(const Entry* entry) {
  if (entry == nullptr) return std::nullopt;
  const bool header = entry->value.starts_with("[") && entry->value.ends_with("]") &&
                      entry->value.find(entry->path) != std::string_view::npos;
  return Fact{"", header ? Quoted(entry->value) : Quoted(entry->path), entry->line};
}

/// `schema` of TOML and JSON.
void ReadSchema(const Outline& file, Recognition& found, double newest) {
  const Entry* const entry = file.Find("schema");
  const auto schema = NumberOf(file, entry);
  if (!schema) return;
  AddFact(found, "schema", Quoted(entry->value), entry->line);
  if (*schema > newest) {
    Contradict(
        found, "schema",
        fmt::format("{:g} is newer than this version of Plumbline reads ({:g})", *schema, newest),
        entry->line);
  }
}

void ReadCellFile(const Outline& file, Recognition& found) {
  ReadSchema(file, found, 2);
  AddValue(file, "robot.name", "robot", found);
  AddValue(file, "robot.convention", "convention", found);
  const std::size_t joints = file.Count("robot.joint"), effects = file.Count("effect");
  if (joints > 0) {
    AddFact(found, "joints", fmt::format("{}", joints), file.Find("robot.joint")->line);
  }
  AddValue(file, "tool.model", "tool", found);
  AddValue(file, "measurement.kind", "measured", found);
  if (effects > 0) {
    AddFact(found, "effects", fmt::format("{}", effects), file.Find("effect")->line);
  }
}

void ReadProfile(const Outline& file, Recognition& found) {
  ReadSchema(file, found, 1);
  AddValue(file, "name", "for", found);
}

template <const char* const& kPath>
void ReadCount(const Outline& file, Recognition& found) {
  ReadSchema(file, found, 1);
  const std::size_t count = file.Count(kPath);
  if (count > 0) AddFact(found, kPath, fmt::format("{}", count), file.Find(kPath)->line);
}
constexpr const char *kBody = "body", *kObject = "object", *kColumn = "column";

const Entry* JsonKey(const Outline& file, std::initializer_list<std::string_view> all) {
  if (file.syntax() != Syntax::kBraces) return nullptr;
  const Entry* first = nullptr;
  for (const std::string_view key : all) {
    const Entry* found = file.Find(key);
    if (found == nullptr) {
      const std::string within = std::string(key) + ".";
      const auto inside = std::ranges::find_if(
          file.entries(), [&](const Entry& entry) { return entry.path.starts_with(within); });
      if (inside != file.entries().end()) found = &*inside;
    }
    if (found == nullptr) return nullptr;
    if (first == nullptr) first = found;
  }
  return first;
}

constexpr std::array kOwnKinds = {
    Kind{"lens-json", "a lens of plumbline calibrate-lens (LENS.json)", Content::kLens,
         [](const Outline& file) {
           return KeyOf(JsonKey(file, {"fx", "fy", "image_size", "schema"}));
         },
         [](const Outline& file, Recognition& found) {
           ReadSchema(file, found, 1);
           AddValue(file, "accepted", "accepted", found);
           AddValue(file, "image_size", "image size [px]", found);
           AddValue(file, "model", "distortion model", found);
           AddValue(file, "fx", "fx [px]", found);
           AddValue(file, "fy", "fy [px]", found);
           AddValue(file, "rms_px", "rms [px]", found);
         },
         "plumbline track --image IMAGE --intrinsics {} --tag-size-mm SIZE", ""},
    Kind{"hand-eye-json", "a result of plumbline calibrate-hand-eye", Content::kHandEye,
         [](const Outline& file) {
           return KeyOf(JsonKey(file, {"setup", "camera", "schema"}));
         },
         [](const Outline& file, Recognition& found) {
           ReadSchema(file, found, 1);
           AddValue(file, "setup", "setup", found);
           AddValue(file, "accepted", "accepted", found);
         },
         "",
         "Copy the pose of the camera into plumbline.toml ([camera]) or the cell "
         "([measurement])."},
    Kind{"diagnosis-json", "an answer of plumbline diagnose (DIAGNOSIS.json)", Content::kDiagnosis,
         [](const Outline& file) {
           return KeyOf(JsonKey(file, {"verdict", "effects", "schema"}));
         },
         [](const Outline& file, Recognition& found) {
           ReadSchema(file, found, 1);
           AddValue(file, "verdict", "verdict", found);
         },
         "plumbline model propose CORRECTED.toml --diagnosis {}", ""},
    Kind{"state-json", "the state of the daemon's model store (state.json)", Content::kState,
         [](const Outline& file) {
           return KeyOf(JsonKey(file, {"applied", "proposed", "history", "schema"}));
         },
         [](const Outline& file, Recognition& found) { ReadSchema(file, found, 1); },
         "plumbline model list --state FOLDER", ""},
    Kind{"zoom-profile", "a profile of a zoom lens", Content::kZoomProfile,
         [](const Outline& file) { return KeyOf(TomlListOf(file, "exchange")); }, ReadProfile, "",
         "Name it in plumbline.toml: [camera.zoom] profile = \"{}\", then: plumbline check "
         "plumbline.toml"},
    Kind{"robot-profile", "a register profile of a robot controller", Content::kRobotProfile,
         [](const Outline& file) -> std::optional<Fact> {
           const Entry* const read = TomlListOf(file, "read");
           return KeyOf(read != nullptr ? read : TomlListOf(file, "joints"));
         },
         ReadProfile, "",
         "Name it in plumbline.toml: [robot] profile = \"{}\", then: plumbline check "
         "plumbline.toml"},
    Kind{"configuration", "the configuration of a daemon (plumbline.toml)", Content::kConfiguration,
         [](const Outline& file) -> std::optional<Fact> {
           const Entry* const cell = file.syntax() == Syntax::kToml ? file.Find("cell") : nullptr;
           return cell != nullptr && cell->value.ends_with(".toml")
                      ? Fact{"", fmt::format("cell = \"{}\"", Quoted(cell->value)), cell->line}
                      : std::optional<Fact>();
         },
         [](const Outline& file, Recognition& found) {
           AddValue(file, "cell", "cell", found);
           AddValue(file, "robot.profile", "profile", found);
           const std::size_t points = file.Count("point");
           if (points > 0) {
             AddFact(found, "points", fmt::format("{}", points), file.Find("point")->line);
           }
         },
         "plumbline check {}", ""},
    Kind{"tags", "tags and bodies (bodies.toml)", Content::kTags,
         [](const Outline& file) {
           const Entry* const body = TomlListOf(file, "body");
           return KeyOf(body != nullptr ? body : TomlListOf(file, "tag"));
         },
         ReadCount<kBody>, "plumbline track --image IMAGE --intrinsics LENS.json --bodies {}", ""},
    Kind{"objects", "virtual objects (objects.toml)", Content::kObjects,
         [](const Outline& file) { return KeyOf(TomlListOf(file, "object")); }, ReadCount<kObject>,
         "",
         "Name it in plumbline.toml: [overlay] objects = \"{}\", then: plumbline check "
         "plumbline.toml"},
    Kind{"mapping", "a mapping of columns, written by plumbline import", Content::kMapping,
         [](const Outline& file) { return KeyOf(TomlListOf(file, "column")); }, ReadCount<kColumn>,
         "plumbline import TABLE.csv --mapping {} --preview", ""},
    Kind{"cell", "a model of a cell (cell.toml)", Content::kCell,
         [](const Outline& file) -> std::optional<Fact> {
           const Entry* const key = FirstOf(file, {"robot.joint", "robot.convention", "tool.model",
                                                   "tool.tcp_mm", "tool.length_mm"});
           const Entry* const schema = FirstOf(file, {"schema"});
           if (schema != nullptr || FirstOf(file, {"robot"}) != nullptr) {
             if (key != nullptr) return KeyOf(key);
           }
           return schema != nullptr && file.FindName("robot.name") != nullptr ? KeyOf(schema)
                                                                              : std::nullopt;
         },
         ReadCellFile, "plumbline check {}", ""},
    Kind{"configuration", "the configuration of a daemon (plumbline.toml)", Content::kConfiguration,
         [](const Outline& file) {
           return KeyOf(FirstOf(file, {"plc", "point", "frame", "push", "monitoring", "cycle",
                                       "correction", "state_directory", "robot.profile",
                                       "robot.host", "robot.transport", "robot.replay_file"}));
         },
         nullptr, "plumbline check {}", ""},
};

}  // namespace

std::span<const Kind> OwnKinds() {
  return kOwnKinds;
}

}  // namespace plumbline::recognition
