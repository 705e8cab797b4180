#include "app/base/config/body_reader.h"

#include <fmt/format.h>

#include <map>
#include <set>

#include "app/base/config/limits.h"
#include "app/base/config/toml_reader.h"
#include "app/base/config/wrong_file.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::config {
namespace {

constexpr int kMaxId = 100000;
constexpr NumberRange kSize{1, 2000, kMetrePerMm};
constexpr NumberRange kPlaceSd{0, 100, kMetrePerMm};

/// The key drawn_by of a table, or what the surrounding table says.
target::DrawnBy DrawnByFrom(const TomlTable& table, target::DrawnBy surrounding) {
  using target::DrawnBy;
  return table
      .OneOf<DrawnBy>("drawn_by", {{"apriltag", DrawnBy::kAprilTag}, {"opencv", DrawnBy::kOpenCv}})
      .value_or(surrounding);
}

class Reader {
 public:
  /// Reads the id of a tag; an id that appeared earlier in the file is a fault.
  std::optional<int> NewId(const TomlTable& table) {
    const auto id = table.RequiredInteger("id", 0, kMaxId);
    if (!id) return std::nullopt;
    const auto [first, is_new] = line_of_id_.emplace(*id, table.LineOf("id"));
    if (!is_new) table.AddFault("id", fmt::format("is already used in line {}", first->second));
    return id;
  }

  std::optional<target::BodyTag> TagOfBody(const TomlTable& table,
                                           std::optional<double> body_size_m,
                                           target::DrawnBy drawn_by) {
    const auto id = NewId(table);
    const auto size =
        body_size_m && !table.Has("size_mm") ? body_size_m : table.RequiredNumber("size_mm", kSize);
    const auto p = table.RequiredVector3("xyz_mm", kPlaceRange);
    const Vec3 rpy = table.Vector3("rpy_deg", kTurnRange).value_or(Vec3::Zero());
    drawn_by = DrawnByFrom(table, drawn_by);
    if (!id || !size || !p) return std::nullopt;
    return target::BodyTag{*id, *size, {RotationFromRollPitchYaw(rpy), *p}, drawn_by};
  }

  std::optional<target::Body> BodyFrom(const TomlTable& table, target::DrawnBy drawn_by) {
    target::Body body;
    body.name = table.RequiredString("name").value_or("");
    if (!body.name.empty() && !names_.insert(body.name).second) {
      table.AddFault("name", "is the name of another body");
    }
    const auto size = table.Number("size_mm", kSize);
    body.place_sd_m = table.Number("place_sd_mm", kPlaceSd);
    drawn_by = DrawnByFrom(table, drawn_by);
    const std::vector<TomlTable> tags = table.Tables("tag");
    if (tags.empty()) table.AddMissing("tag", "at least one [[body.tag]]");
    for (const TomlTable& tag : tags) {
      if (const auto read = TagOfBody(tag, size, drawn_by)) body.tags.push_back(*read);
    }
    return body;
  }

 private:
  std::map<int, int> line_of_id_;
  std::set<std::string> names_;
};

}  // namespace

std::optional<target::TagDatabase> TagDatabaseFromText(std::string_view text,
                                                       const std::string& file, FaultList& faults) {
  if (RefuseWrongFile(text, file, kWantedTags, faults)) return std::nullopt;
  return ReadDocument(text, file, faults, [](TomlDocument& document) {
    target::TagDatabase database;
    Reader reader;
    const TomlTable root = document.Root();
    root.RequiredInteger("schema", 1, 1);
    database.drawn_by = DrawnByFrom(root, target::DrawnBy::kUnspecified);
    for (const TomlTable& tag : root.Tables("tag")) {
      const auto id = reader.NewId(tag);
      const auto size = tag.RequiredNumber("size_mm", kSize);
      const target::DrawnBy drawn_by = DrawnByFrom(tag, database.drawn_by);
      if (id && size) database.tags.push_back({*id, *size, drawn_by});
    }
    for (const TomlTable& body : root.Tables("body")) {
      if (auto read = reader.BodyFrom(body, database.drawn_by))
        database.bodies.push_back(std::move(*read));
    }
    return database;
  });
}

}  // namespace plumbline::config
