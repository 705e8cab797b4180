#include <fmt/format.h>

#include "app/base/config/body_reader.h"
#include "app/base/config/daemon_settings.h"
#include "app/base/config/unlikely_values.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::config {

CameraConfig CameraFromToml(const TomlTable& table, const NamedFiles& files) {
  CameraConfig camera;
  ReadKeys(table, camera, &files);
  const image::ImageSize& size = camera.connection.v4l2.mode.size;
  if ((size.width == 0) != (size.height == 0)) {
    table.AddFault("width_px", "and height_px must be given together");
  }
  if (camera.kind == "dv") {
    for (const char* key : {"width_px", "height_px", "rate_hz", "exposure_ms", "gain_counts",
                            "white_balance_K", "focus_counts", "path", "repeat", "mode"}) {
      if (!table.Has(key)) continue;
      table.AddWarning(key,
                       "is not used for kind = \"dv\": a DV camcorder cannot be set from "
                       "here; set it on the camcorder and remove this line");
    }
  }
  for (const std::string& word : camera.required_for) {
    if (word == kRequiredForPoints) continue;
    table.AddFault("required_for", fmt::format("contains \"{}\"; it may contain \"{}\" only", word,
                                               kRequiredForPoints));
  }
  return camera;
}

BoardConfig BoardFromToml(const TomlTable& table) {
  BoardConfig config;
  const bool printed = ReadKeys(table, config.board);
  ReadKeys(table, config);
  if (config.max_views < config.views) table.AddFault("most_views", "is below views");
  // Values are checked against each other only if all of them could be read.
  const auto fault = printed ? FaultOf(config.board) : std::nullopt;
  if (fault && table.Has(fault->key))
    table.AddFault(fault->key, "is not possible: " + fault->message);
  if (fault && !table.Has(fault->key)) table.AddMissing(fault->key, fault->message);
  return config;
}

namespace {

void CheckBody(const TomlTable& table, const char* key, const std::string& name,
               const target::TagDatabase& database, std::size_t min_tags) {
  for (const target::Body& body : database.bodies) {
    if (body.name != name) continue;
    if (body.tags.size() >= min_tags) return;
    table.AddFault(
        key, fmt::format("\"{}\" has {} tags; {} are needed", name, body.tags.size(), min_tags));
    return;
  }
  table.AddFault(key, fmt::format("\"{}\" is not a [[body]] in the tag file", name));
}

}  // namespace

TagsConfig TagsFromToml(const TomlTable& table, const NamedFiles& files, FaultList& faults) {
  TagsConfig tags;
  bool known = false;
  if (const auto file = files.Read(table, "file", "")) {
    tags.file = file->first;
    tags.text = file->second;
    if (auto database = TagDatabaseFromText(file->second, file->first, faults)) {
      tags.database = std::move(*database);
      known = true;
    }
  }
  ReadKeys(table, tags);
  WarnAboutRadians(table, "cell_rpy_deg");
  for (target::Body& body : tags.database.bodies) {
    if (body.place_sd_m) continue;
    body.place_sd_m = body.name == tags.cell ? tags.place_sd_m : target::kPlaceSdOnOnePlate_m;
  }
  if (!known) return tags;
  CheckBody(table, "cell", tags.cell, tags.database, 2);
  if (!tags.tool.empty()) CheckBody(table, "tool", tags.tool, tags.database, 1);
  if (tags.database.bodies.size() > status::CameraStatus::kMaxBodies) {
    table.AddWarning("file",
                     fmt::format("has {} bodies; only the first {} are reported to the PLC",
                                 tags.database.bodies.size(), status::CameraStatus::kMaxBodies));
  }
  return tags;
}

}  // namespace plumbline::config
