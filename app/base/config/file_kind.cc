#include "app/base/config/file_kind.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/base/config/toml_reader.h"

namespace plumbline::config {
namespace {

bool HasOneOf(const TomlTable& table, std::initializer_list<std::string_view> keys) {
  return std::any_of(keys.begin(), keys.end(),
                     [&table](std::string_view key) { return table.Has(key); });
}

}  // namespace

std::optional<FileKind> FileKindOf(std::string_view text) {
  FaultList ignored;
  TomlDocument document(text, "", ignored);
  const TomlTable root = document.Root();
  const auto robot = root.Table("robot");
  if (HasOneOf(root, {"joints", "read", "exchange"})) return FileKind::kProfile;
  if (root.Has("cell")) return FileKind::kConfiguration;
  if (HasOneOf(root, {"schema", "tool"}) || (robot && HasOneOf(*robot, {"joint", "convention"}))) {
    return FileKind::kCell;
  }
  if (HasOneOf(root, {"plc", "point", "frame", "push", "monitoring", "cycle", "correction",
                      "state_directory"}) ||
      (robot && HasOneOf(*robot, {"profile", "host", "transport", "replay_file"}))) {
    return FileKind::kConfiguration;
  }
  return std::nullopt;
}

std::optional<std::string> WhyNotACell(std::string_view text) {
  if (text.find_first_not_of(" \t\r\n") == std::string_view::npos) {
    return "is empty; start from a cell in config/cells";
  }
  const auto kind = FileKindOf(text);
  if (kind == FileKind::kProfile) {
    return "is a robot profile or a lens profile, not a cell; give the plumbline.toml that refers "
           "to it";
  }
  if (kind != FileKind::kConfiguration) return std::nullopt;
  FaultList ignored;
  TomlDocument document(text, "", ignored);
  const auto cell = document.Root().String("cell");
  return "is the daemon's configuration, not a cell; " +
         (cell ? fmt::format("give its cell, \"{}\"", *cell)
               : std::string("give the CELL.toml that belongs to it"));
}

}  // namespace plumbline::config
