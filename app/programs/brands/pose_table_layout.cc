#include "app/programs/brands/pose_table_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "app/measure/imports/column_meaning.h"
#include "app/programs/brands/source_cursor.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::programs::pose_table {
namespace {

using Columns = std::map<std::string, std::size_t>;

/// A column's name without its unit, in lower case and without blanks and underscores.
std::string PlainName(std::string_view name, std::string_view unit) {
  std::string plain;
  for (const char c : Lowered(name)) {
    if (c == '[' || c == '(') break;
    if (IsWordSign(c) && c != '_') plain += c;
  }
  const std::string suffix = Lowered(unit);
  if (!suffix.empty() && plain.size() > suffix.size() && plain.ends_with(suffix))
    plain.resize(plain.size() - suffix.size());
  return plain;
}

/// The columns with these names, or nothing if one is missing.
template <std::size_t N>
std::optional<std::vector<std::size_t>> All(const Columns& columns,
                                            const std::array<const char*, N>& names) {
  std::vector<std::size_t> found;
  for (const char* const name : names) {
    const auto at = columns.find(name);
    if (at == columns.end()) return std::nullopt;
    found.push_back(at->second);
  }
  return found;
}

std::optional<std::size_t> One(const Columns& columns, std::initializer_list<const char*> names) {
  for (const char* const name : names) {
    if (const auto at = columns.find(name); at != columns.end()) return at->second;
  }
  return std::nullopt;
}

/// The one unit of some columns, or an error that names the column.
Result<std::string> UnitOf(const std::vector<std::size_t>& columns,
                           const std::vector<measure::ColumnMeaning>& meanings,
                           const std::vector<std::string>& names,
                           std::initializer_list<std::string_view> known) {
  for (const std::size_t column : columns) {
    const std::string& unit = meanings[column].unit;
    if (std::ranges::find(known, unit) == known.end() || unit != meanings[columns[0]].unit) {
      return Error{
          fmt::format("column {}: its unit is not one of {} that all its neighbours have; "
                      "write it in the header, as {}_{}",
                      names[column], fmt::join(known, ", "), names[column], *known.begin())};
    }
  }
  return meanings[columns[0]].unit;
}

}  // namespace

Result<Layout> LayoutOf(std::string_view bytes) {
  if (bytes.find('\0') != std::string_view::npos) {
    return Error{"not a text of single bytes: save it as UTF-8"};
  }
  Layout layout;
  layout.table = text::LayoutOf(bytes, {});
  const text::DelimitedText& table = layout.table;
  constexpr std::string_view kHeader =
      "add a first line such as x_mm,y_mm,z_mm,roll_deg,pitch_deg,yaw_deg (or a_deg,b_deg,c_deg; "
      "w_deg,p_deg,r_deg; rotvec_x_rad,rotvec_y_rad,rotvec_z_rad; qw,qx,qy,qz)";
  if (table.header_line == 0) return Error{fmt::format("no column names: {}", kHeader)};
  if (table.decimal != '.') return Error{"decimal commas: write the numbers with decimal points"};

  const auto meanings = measure::MeaningsOf(table.names, table.units);
  Columns targets, plain;
  for (std::size_t i = 0; i < meanings.size(); ++i) {
    if (!meanings[i].target.empty()) targets.try_emplace(meanings[i].target, i);
    plain.try_emplace(PlainName(table.names[i], meanings[i].unit), i);
  }
  layout.name = One(targets, {"name", "number"});
  layout.tool = One(plain, {"tool", "tcp"});
  layout.base = One(plain, {"base", "frame", "wobj", "uframe"});
  layout.load = One(plain, {"load", "payload"});

  std::vector<std::size_t> joints;
  for (int joint = 1; joint <= 12; ++joint) {
    const auto at = targets.find(fmt::format("q{}_deg", joint));
    if (at == targets.end()) break;
    joints.push_back(at->second);
  }
  if (!joints.empty()) {
    const auto unit = UnitOf(joints, meanings, table.names, {"deg", "rad"});
    if (!unit) return unit.failure();
    layout.joints = joints;
    layout.rad_per_joint_unit = *unit == "deg" ? kRadPerDeg : 1;
  }
  const auto position = All(targets, std::array{"x_mm", "y_mm", "z_mm"});
  if (!position) {
    if (joints.empty()) return Error{fmt::format("no poses and no joints: {}", kHeader)};
    if (layout.rad_per_joint_unit == 1) layout.orientation = Orientation::kRpyRadians;
    return layout;
  }
  std::ranges::copy(*position, layout.position.begin());
  const auto length = UnitOf(*position, meanings, table.names, {"mm", "m"});
  if (!length) return length.failure();
  layout.m_per_unit = *length == "m" ? 1 : 1e-3;
  layout.has_pose = true;

  if (const auto quaternion = All(targets, std::array{"qw", "qx", "qy", "qz"})) {
    layout.orientation = Orientation::kQuaternion;
    layout.angles = *quaternion;
    return layout;
  }
  if (const auto vector = All(plain, std::array{"rotvecx", "rotvecy", "rotvecz"})) {
    const auto unit = UnitOf(*vector, meanings, table.names, {"rad"});
    if (!unit) return unit.failure();
    layout.orientation = Orientation::kVectorRadians;
    layout.angles = *vector;
    return layout;
  }
  std::optional<std::vector<std::size_t>> angles;
  for (const auto& names :
       {std::array{"roll", "pitch", "yaw"}, std::array{"w", "p", "r"}, std::array{"c", "b", "a"}}) {
    if (!angles) angles = All(plain, names);
  }
  if (!angles) {
    const bool ambiguous = All(plain, std::array{"rx", "ry", "rz"}).has_value();
    return Error{fmt::format("{}: {}",
                             ambiguous
                                 ? "rx, ry, rz may be a rotation vector or angles in several orders"
                                 : "no orientation that is understood",
                             kHeader)};
  }
  const auto unit = UnitOf(*angles, meanings, table.names, {"deg", "rad"});
  if (!unit) return unit.failure();
  layout.orientation = *unit == "deg" ? Orientation::kRpyDegrees : Orientation::kRpyRadians;
  layout.angles = *angles;
  return layout;
}

}  // namespace plumbline::programs::pose_table
