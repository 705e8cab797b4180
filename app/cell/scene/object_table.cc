#include "app/cell/scene/object_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "app/base/config/toml_reader.h"
#include "app/base/config/wrong_file.h"
#include "app/base/text/text.h"
#include "app/cell/scene/mesh_format.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::cell {
namespace {

constexpr int kLargestTag = 100000, kLargestNumber = 9999;
constexpr double kShare = 0.4;  ///< share of a word that may differ for a suggestion
constexpr config::NumberRange kPlace{-100000, 100000, kMetrePerMm};
constexpr config::NumberRange kTurn{-360, 360, kRadPerDeg};
constexpr config::NumberRange kShade{0, 1};

class TableReader {
 public:
  TableReader(const std::string& file, const target::TagDatabase* tags)
      : folder_(std::filesystem::path(file).parent_path()), tags_(tags) {}

  ObjectTable Read(const config::TomlTable& root) {
    root.RequiredInteger("schema", 1, 1);
    table_.background = root.Bool("background").value_or(true);
    const auto objects = root.Tables("object");
    if (objects.empty()) root.AddWarning("object", "missing; no virtual objects are shown");
    if (objects.size() > kMostSceneObjects) {
      root.AddFault("object", fmt::format("{} objects; at most {} are allowed", objects.size(),
                                          kMostSceneObjects));
    }
    for (const config::TomlTable& object : objects) table_.objects.push_back(ObjectFrom(object));
    for (const config::TomlTable& point : root.Tables("point"))
      table_.points.push_back(PointFrom(point));
    for (const config::TomlTable& pair : root.Tables("pair")) PairFrom(pair);
    for (const config::TomlTable& line : root.Tables("line"))
      table_.lines.push_back(LineFrom(line));
    for (const config::TomlTable& distance : root.Tables("distance")) DistanceFrom(distance);
    if (const auto clip = root.Table("clip")) table_.clip = ClipFrom(*clip);
    return std::move(table_);
  }

 private:
  /// The table's name, which must be unique among its kind; empty if missing.
  static std::string NewName(const config::TomlTable& table, std::set<std::string>& names) {
    std::string name = table.RequiredString("name").value_or("");
    if (!name.empty() && !names.insert(name).second) {
      table.AddFault("name", "is used by another table of this kind");
    }
    return name;
  }

  static std::string Suggestion(const std::string& word, const std::vector<std::string>& known) {
    const std::string nearest = text::NearestWord(word, known, kShare);
    if (!nearest.empty()) return fmt::format("; did you mean \"{}\"?", nearest);
    std::string all;
    for (const std::string& one : known) all += (all.empty() ? "" : ", ") + one;
    return known.empty() ? "; none is defined" : "; known are " + all;
  }

  void CheckTag(const config::TomlTable& on, int id) const {
    if (tags_ == nullptr || tags_->default_side_m) return;
    std::vector<int> ids;
    for (const target::StandaloneTag& tag : tags_->tags) ids.push_back(tag.id);
    for (const target::Body& body : tags_->bodies) {
      for (const target::BodyTag& tag : body.tags) ids.push_back(tag.id);
    }
    if (std::find(ids.begin(), ids.end(), id) != ids.end()) return;
    const auto nearer = [id](int a, int b) { return std::abs(a - id) < std::abs(b - id); };
    const auto nearest = std::min_element(ids.begin(), ids.end(), nearer);
    on.AddFault("tag", "is not defined in the file of tags and bodies" +
                           (nearest == ids.end()
                                ? std::string("; it has no tags")
                                : fmt::format("; the nearest of {} is {}", ids.size(), *nearest)));
  }

  void CheckBody(const config::TomlTable& on, const std::string& name) const {
    if (tags_ == nullptr) return;
    std::vector<std::string> names;
    for (const target::Body& body : tags_->bodies) names.push_back(body.name);
    if (std::find(names.begin(), names.end(), name) != names.end()) return;
    on.AddFault("body", "is not defined in the file of tags and bodies" + Suggestion(name, names));
  }

  Carrier CarrierFrom(const config::TomlTable& table) const {
    Carrier carrier;
    const auto on = table.RequiredTable("on");
    if (!on) return carrier;
    int given = 0;
    for (const char* const key : {"body", "tag", "link", "frame"}) given += on->Has(key) ? 1 : 0;
    const auto body = on->String("body");
    const auto tag = on->Integer("tag", 0, kLargestTag);
    const auto link = on->Integer("link", 1, model::kMaxJoints);
    const auto frame = on->OneOf<Carrier::Kind>("frame", {{"world", Carrier::Kind::kWorld},
                                                          {"base", Carrier::Kind::kBase},
                                                          {"flange", Carrier::Kind::kFlange}});
    if (given != 1) {
      table.AddFault(
          "on",
          "needs exactly one of body = \"...\", tag = ..., link = ..., frame = \"world\", "
          "\"base\" or \"flange\"");
      return carrier;
    }
    if (frame) carrier.kind = *frame;
    if (link) carrier = {Carrier::Kind::kLink, "", 0, *link};
    if (body) {
      carrier = {Carrier::Kind::kBody, *body, 0};
      CheckBody(*on, *body);
    }
    if (tag) {
      carrier = {Carrier::Kind::kTag, "", *tag};
      CheckTag(*on, *tag);
    }
    return carrier;
  }

  static Pose PoseOfTable(const config::TomlTable& table) {
    return {RotationFromRollPitchYaw(table.Vector3("rpy_deg", kTurn).value_or(Vec3::Zero())),
            table.Vector3("xyz_mm", kPlace).value_or(Vec3::Zero())};
  }

  static scene::Colour ColourFrom(const config::TomlTable& table, scene::Colour colour) {
    const auto values = table.Numbers("colour", kShade);
    if (!values) return colour;
    if (values->size() != 3 && values->size() != 4) {
      table.AddFault("colour", "is not a list of 3 numbers (red, green, blue) or 4 (and opacity)");
      return colour;
    }
    const auto value = [&values](std::size_t i) { return static_cast<float>((*values)[i]); };
    return {value(0), value(1), value(2), values->size() == 4 ? value(3) : 1};
  }

  SceneObject ObjectFrom(const config::TomlTable& table) {
    SceneObject object;
    object.name = NewName(table, object_names_);
    names_in_order_.push_back(object.name);
    object.number = table.RequiredInteger("number", 1, kLargestNumber).value_or(0);
    if (object.number != 0 && !numbers_.insert(object.number).second) {
      table.AddFault("number", "is the number of another object");
    }
    if (const auto file = table.RequiredString("file")) {
      if (!MeshFormatOfName(*file)) {
        table.AddFault("file", fmt::format("must end in one of {}", kMeshFormats));
      }
      object.file = (folder_ / *file).lexically_normal().string();
    }
    // The unit is never guessed: only the author of a file without a unit knows it.
    object.unit = table.RequiredString("unit").value_or("m");
    const auto unit_m = MetresOfUnit(object.unit);
    if (!unit_m) table.AddFault("unit", fmt::format("must be one of {}", kMeshUnits));
    object.unit_m = unit_m.value_or(1);
    object.on = CarrierFrom(table);
    object.X_KO = PoseOfTable(table);
    object.scale = table.Number("scale", {0.001, 1000}).value_or(1);
    object.visible = table.Bool("visible").value_or(true);
    object.bends = table.Bool("bends").value_or(false);
    object.occludes = table.Bool("occludes").value_or(false);
    object.colour = ColourFrom(table, object.colour);
    if (object.bends && object.on.kind != Carrier::Kind::kFlange) {
      table.AddFault("bends",
                     "needs on = { frame = \"flange\" }: an object on a tag or body is already "
                     "drawn where the bent tool carries it");
    }
    return object;
  }

  std::optional<std::size_t> PlaceOf(const config::TomlTable& table, std::string_view key,
                                     const std::string& name) const {
    const auto found = std::find(names_in_order_.begin(), names_in_order_.end(), name);
    if (found != names_in_order_.end()) {
      return static_cast<std::size_t>(found - names_in_order_.begin());
    }
    table.AddFault(key, fmt::format("names \"{}\", which is not an object{}", name,
                                    Suggestion(name, names_in_order_)));
    return std::nullopt;
  }

  void PairFrom(const config::TomlTable& table) {
    ScenePair pair;
    pair.near_m = table.Number("near_mm", {0, 10000, kMetrePerMm}).value_or(0);
    pair.end_m = table.Number("end_mm", {0.01, 1000, kMetrePerMm}).value_or(1e-3);
    if (!table.Has("objects")) table.AddMissing("objects", "the names of two objects");
    const auto names = table.Strings("objects");
    if (!names) return;
    if (names->size() != 2 || (*names)[0] == (*names)[1]) {
      table.AddFault("objects", "is not a list of two different objects");
      return;
    }
    const auto a = PlaceOf(table, "objects", (*names)[0]);
    const auto b = PlaceOf(table, "objects", (*names)[1]);
    if (!a || !b) return;
    if (table_.objects[*a].on == table_.objects[*b].on && !table_.objects[*a].bends &&
        !table_.objects[*b].bends) {
      table.AddWarning("objects", "have the same carrier and never move relative to each other");
    }
    pair.a = *a;
    pair.b = *b;
    table_.pairs.push_back(pair);
  }

  void SweepFrom(const config::TomlTable& table, SceneLine& line) const {
    const auto name = table.String("sweep");
    const Pose X_PO{
        RotationFromRollPitchYaw(table.Vector3("sweep_rpy_deg", kTurn).value_or(Vec3::Zero())),
        Vec3::Zero()};
    const Vec3 p_O = table.Vector3("sweep_point_mm", kPlace).value_or(Vec3::Zero());
    const auto against = table.Strings("against");
    if (!name) {
      for (const std::string_view key : {"sweep_rpy_deg", "sweep_point_mm", "against"}) {
        if (table.Has(key)) table.AddFault(key, "needs sweep = \"...\", the object to be moved");
      }
      return;
    }
    SceneSweep sweep;
    const auto object = PlaceOf(table, "sweep", *name);
    if (!against) table.AddMissing("against", "the names of the objects to check for collision");
    for (const std::string& other : against.value_or(std::vector<std::string>())) {
      if (other == *name) table.AddFault("against", "names the swept object itself");
      if (const auto place = PlaceOf(table, "against", other)) sweep.against.push_back(*place);
    }
    if (!object) return;
    sweep.object = *object;
    sweep.X_KO = {X_PO.R, -(X_PO.R * p_O)};
    line.sweep = sweep;
  }

  SceneLine LineFrom(const config::TomlTable& table) {
    SceneLine line;
    line.name = NewName(table, line_names_);
    line.on = CarrierFrom(table);
    if (!table.Has("points_mm")) table.AddMissing("points_mm", "a list of points, 3 numbers each");
    if (const auto points = table.Rows("points_mm", kPlace)) {
      if (points->rows() < 2 || points->cols() != 3) {
        table.AddFault("points_mm", "is not a list of two or more points of 3 numbers");
      } else {
        for (Eigen::Index i = 0; i < points->rows(); ++i) {
          line.points_K.emplace_back(points->row(i).transpose());
        }
      }
    }
    line.visible = table.Bool("visible").value_or(true);
    line.dashed = table.Bool("dashed").value_or(false);
    line.width_px = static_cast<float>(table.Number("width_px", {0.5, 20}).value_or(2));
    line.colour = ColourFrom(table, line.colour);
    SweepFrom(table, line);
    return line;
  }

  ScenePoint PointFrom(const config::TomlTable& table) {
    ScenePoint point;
    point.name = NewName(table, point_names_);
    if (object_names_.count(point.name) > 0) {
      table.AddFault("name", "is also the name of an object, so that a distance is ambiguous");
    }
    point_names_in_order_.push_back(point.name);
    point.p = table.RequiredVector3("xyz_mm", kPlace).value_or(Vec3::Zero());
    if (table.Has("of") == table.Has("on")) {
      table.Ignore({"of", "on"});
      table.AddFault("", "needs exactly one of of = \"an object\" and on = { ... }");
      return point;
    }
    if (const auto object = table.String("of")) {
      if (const auto place = PlaceOf(table, "of", *object)) point.of = *place;
    } else if (table.Has("on")) {
      point.of = CarrierFrom(table);
    }
    return point;
  }

  std::optional<SceneDistance::End> EndFrom(const config::TomlTable& table,
                                            std::string_view key) const {
    const auto name = table.RequiredString(key);
    if (!name) return std::nullopt;
    std::vector<std::string> known = point_names_in_order_;
    const auto point = std::find(known.begin(), known.end(), *name);
    if (point != known.end()) {
      return SceneDistance::End{false, static_cast<std::size_t>(point - known.begin())};
    }
    const auto object = std::find(names_in_order_.begin(), names_in_order_.end(), *name);
    if (object != names_in_order_.end()) {
      return SceneDistance::End{true, static_cast<std::size_t>(object - names_in_order_.begin())};
    }
    known.insert(known.end(), names_in_order_.begin(), names_in_order_.end());
    table.AddFault(key, "is neither a point nor an object" + Suggestion(*name, known));
    return std::nullopt;
  }

  void DistanceFrom(const config::TomlTable& table) {
    const std::string name = NewName(table, distance_names_);
    const auto from = EndFrom(table, "from"), to = EndFrom(table, "to");
    if (from && to && from->is_object == to->is_object && from->place == to->place) {
      table.AddFault("to", "is the same as from");
    }
    if (from && to) table_.distances.push_back({name, *from, *to});
  }

  SceneClip ClipFrom(const config::TomlTable& table) const {
    SceneClip clip;
    clip.on = CarrierFrom(table);
    clip.distance_m = table.RequiredNumber("distance_mm", kPlace).value_or(0);
    clip.grid = table.Bool("grid").value_or(true);
    const auto normal = table.RequiredVector3("normal", {-1e6, 1e6});
    if (normal && normal->norm() < 1e-6) {
      table.AddFault("normal", "has zero length");
    } else if (normal) {
      clip.normal_K = normal->normalized();
    }
    return clip;
  }

  const std::filesystem::path folder_;
  const target::TagDatabase* const tags_;
  ObjectTable table_;
  std::set<std::string> object_names_, line_names_, point_names_, distance_names_;
  std::set<int> numbers_;
  std::vector<std::string> names_in_order_, point_names_in_order_;
};

}  // namespace

std::optional<ObjectTable> ObjectTableFromText(std::string_view text, const std::string& file,
                                               const target::TagDatabase* tags,
                                               config::FaultList& faults) {
  if (config::RefuseWrongFile(text, file, config::kWantedObjects, faults)) return std::nullopt;
  return config::ReadDocument(text, file, faults, [&](config::TomlDocument& document) {
    return TableReader(file, tags).Read(document.Root());
  });
}

}  // namespace plumbline::cell
