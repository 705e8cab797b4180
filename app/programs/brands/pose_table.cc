#include "app/programs/brands/pose_table.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>

#include "app/programs/brands/orientation_branches.h"
#include "app/programs/brands/pose_table_layout.h"
#include "app/programs/brands/source_cursor.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::programs {
namespace pose_table {
namespace {

std::vector<double> Scaled(std::span<const double> numbers, double factor) {
  std::vector<double> scaled(numbers.begin(), numbers.end());
  for (double& number : scaled) number *= factor;
  return scaled;
}

Result<Mat3> FromRpyRadians(std::span<const double> numbers) {
  return RotationFromRpyDegrees(Scaled(numbers, kDegPerRad));
}
std::vector<double> RpyRadiansNear(const Mat3& R, std::span<const double> old) {
  return Scaled(RpyDegreesNear(R, Scaled(old, kDegPerRad)), kRadPerDeg);
}

Result<Mat3> FromQuaternion(std::span<const double> numbers) {
  if (numbers.size() != 4) return Error{"a quaternion has four numbers"};
  const Eigen::Quaterniond q(numbers[0], numbers[1], numbers[2], numbers[3]);
  const double length = q.norm();
  if (!std::isfinite(length) || length < 0.5 || length > 2)
    return Error{"a quaternion of length 1 is needed"};
  return Mat3(q.normalized().toRotationMatrix());
}
struct Form {
  Orientation orientation;
  double m_per_unit;
  const char* name;
};
constexpr std::array kForms = {
    Form{Orientation::kRpyDegrees, 1e-3, "table of poses (mm, angles in deg)"},
    Form{Orientation::kRpyDegrees, 1, "table of poses (m, angles in deg)"},
    Form{Orientation::kRpyRadians, 1e-3, "table of poses (mm, angles in rad)"},
    Form{Orientation::kRpyRadians, 1, "table of poses (m, angles in rad)"},
    Form{Orientation::kVectorRadians, 1e-3, "table of poses (mm, rotation vector)"},
    Form{Orientation::kVectorRadians, 1, "table of poses (m, rotation vector)"},
    Form{Orientation::kQuaternion, 1e-3, "table of poses (mm, quaternion)"},
    Form{Orientation::kQuaternion, 1, "table of poses (m, quaternion)"},
};

Conventions ConventionsOf(const Form& form) {
  Conventions conventions;
  conventions.m_per_unit = form.m_per_unit;
  conventions.length.least_decimals = form.m_per_unit == 1 ? 6 : 3;
  switch (form.orientation) {
    case Orientation::kRpyDegrees:
      conventions.angle.least_decimals = 4;
      conventions.turn = 360;
      conventions.rotation = RotationFromRpyDegrees;
      conventions.numbers = RpyDegreesNear;
      break;
    case Orientation::kRpyRadians:
      conventions.rad_per_unit = 1;
      conventions.angle.least_decimals = 6;
      conventions.turn = 2 * std::numbers::pi;
      conventions.rotation = FromRpyRadians;
      conventions.numbers = RpyRadiansNear;
      break;
    case Orientation::kVectorRadians:
      conventions.angle.least_decimals = 6;
      conventions.rotation = RotationFromVectorNumbers;
      conventions.numbers = VectorNear;
      break;
    case Orientation::kQuaternion:
      conventions.orientation_numbers = 4;
      conventions.angle.least_decimals = 7;
      conventions.rotation = FromQuaternion;
      conventions.numbers = QuaternionNear;
      break;
  }
  return conventions;
}

bool NamesTable(const SourceFile& file, bool also_text) {
  const std::string name = Lowered(file.name);
  return name.ends_with(".csv") || name.ends_with(".tsv") || (also_text && name.ends_with(".txt"));
}

/// Fields of a line with their places, split as text::LayoutOf splits them.
std::vector<Span> FieldsOf(std::string_view line, std::size_t file, std::size_t begin,
                           char separator) {
  std::vector<Span> fields;
  const auto add = [&](std::size_t first, std::size_t last) {
    const auto outer = [&](std::size_t at) {
      return IsBlank(line[at]) || line[at] == '\r' || line[at] == '"';
    };
    while (first < last && outer(first)) ++first;
    while (last > first && outer(last - 1)) --last;
    fields.push_back({file, begin + first, begin + last});
  };
  bool quoted = false;
  std::size_t first = 0;
  for (std::size_t at = 0; at <= line.size(); ++at) {
    if (at < line.size() && line[at] == '"' && separator != ' ') quoted = !quoted;
    const bool ends = at == line.size() ||
                      (!quoted && (separator == ' ' ? IsBlank(line[at]) : line[at] == separator));
    if (!ends) continue;
    if (separator != ' ' || at > first) add(first, at);
    first = at + 1;
  }
  return fields;
}

class Rows {
 public:
  Rows(std::size_t file, const Layout& layout, Program& program)
      : file_(file), layout_(layout), program_(program) {}

  Routine Read() {
    const SourceFile& source = program_.files[file_];
    Routine routine;
    routine.name = source.name;
    routine.place = {file_, 1};
    routine.starts = true;
    const std::string_view bytes = source.bytes;
    std::size_t begin = 0;
    int line = 1;
    for (const text::Record& record : layout_.table.records) {
      while (line < record.line && begin < bytes.size()) {
        const auto end = bytes.find('\n', begin);
        begin = end == std::string_view::npos ? bytes.size() : end + 1;
        ++line;
      }
      const std::size_t end = std::min(bytes.find('\n', begin), bytes.size());
      Row(record, bytes.substr(begin, end - begin), begin, routine);
    }
    return routine;
  }

 private:
  void Row(const text::Record& record, std::string_view line, std::size_t begin, Routine& routine) {
    const std::vector<Span> fields = FieldsOf(line, file_, begin, layout_.table.separator);
    const auto number = [&](std::size_t column) -> std::optional<Number> {
      if (column >= fields.size()) return std::nullopt;
      const Span& span = fields[column];
      SourceCursor at(program_.files[file_].bytes, file_, span.begin, span.end);
      const auto found = at.TakeNumber();
      return at.AtEnd() ? found : std::nullopt;
    };
    const auto text_of = [&](std::size_t column) {
      return column < record.fields.size() ? record.fields[column] : std::string();
    };
    Point point;
    point.place = {file_, record.line};
    point.name = layout_.name ? text_of(*layout_.name) : fmt::format("line {}", record.line);
    if (layout_.has_pose) {
      for (const std::size_t column : layout_.position) point.numbers.push_back(number(column));
      for (const std::size_t column : layout_.angles) point.numbers.push_back(number(column));
    } else {
      point.kind = PointKind::kJoints;
      for (const std::size_t column : layout_.joints) point.numbers.push_back(number(column));
    }
    for (const auto& part : point.numbers) {
      if (!part) point.untouchable = "a number of this line is missing or not understood";
    }
    if (layout_.has_pose) NearJoints(number, point);

    Step& step = routine.steps.emplace_back();
    step.place = point.place;
    step.motion.kind = layout_.has_pose ? MotionKind::kLinear : MotionKind::kJoint;
    step.motion.statement = {file_, begin, begin + line.size()};
    step.motion.end.point = program_.points.size();
    const auto setting = [&](const char* what, std::optional<std::size_t> column) {
      const std::string text = column ? text_of(*column) : std::string();
      return text.empty() ? std::nullopt
                          : std::optional(Setting{fmt::format("{} {}", what, text), ""});
    };
    step.motion.tool = setting("tool", layout_.tool);
    step.motion.base = setting("base", layout_.base);
    step.motion.load = setting("load", layout_.load);
    program_.points.push_back(std::move(point));
  }

  template <typename NumberAt>
  void NearJoints(const NumberAt& number, Point& point) const {
    std::vector<double> near;
    for (const std::size_t column : layout_.joints) {
      const auto joint = number(column);
      if (!joint) return;
      near.push_back(joint->value * layout_.rad_per_joint_unit);
    }
    point.near_q = std::move(near);
  }

  std::size_t file_;
  const Layout& layout_;
  Program& program_;
};

class Table final : public Brand {
 public:
  explicit Table(const Form& form) : form_(form), conventions_(ConventionsOf(form)) {}

  std::string_view name() const override { return form_.name; }
  const Conventions& conventions() const override { return conventions_; }

  bool Recognises(const SourceFile& file) const override {
    if (!NamesTable(file, true)) return false;
    constexpr std::size_t kSample = 1 << 16;
    std::string_view start(file.bytes);
    if (start.size() > kSample) start = start.substr(0, start.rfind('\n', kSample));
    const auto layout = LayoutOf(start);
    if (!layout) return &form_ == kForms.data() && NamesTable(file, false);
    return layout->orientation == form_.orientation && layout->m_per_unit == form_.m_per_unit;
  }

  Reading Read(std::vector<SourceFile> files) const override {
    Reading reading;
    Program& program = reading.program;
    program.files = std::move(files);
    program.marks.resize(program.files.size());
    for (std::size_t file = 0; file < program.files.size(); ++file) {
      if (!NamesTable(program.files[file], true)) continue;
      const auto layout = LayoutOf(program.files[file].bytes);
      if (!layout) {
        reading.refusals.push_back(
            {file, 1, "a table whose columns are not clear", layout.error()});
        continue;
      }
      program.routines.push_back(Rows(file, *layout, program).Read());
    }
    return reading;
  }

  bool Agrees(const Configuration&, const kinematics::Chain&, const model::JointVector&,
              MotionKind) const override {
    return true;
  }
  std::vector<std::string> ConfigurationOf(const Configuration&, const kinematics::Chain&,
                                           const model::JointVector&) const override {
    return {};
  }
  std::optional<Insertion> Mark(const SourceFile&, std::string_view) const override {
    return std::nullopt;
  }

 private:
  const Form& form_;
  Conventions conventions_;
};

}  // namespace
}  // namespace pose_table

std::span<const Brand* const> PoseTables() {
  static const std::array<pose_table::Table, 8> kTables = {
      pose_table::Table(pose_table::kForms[0]), pose_table::Table(pose_table::kForms[1]),
      pose_table::Table(pose_table::kForms[2]), pose_table::Table(pose_table::kForms[3]),
      pose_table::Table(pose_table::kForms[4]), pose_table::Table(pose_table::kForms[5]),
      pose_table::Table(pose_table::kForms[6]), pose_table::Table(pose_table::kForms[7])};
  static const std::array<const Brand*, 8> kPointers = {&kTables[0], &kTables[1], &kTables[2],
                                                        &kTables[3], &kTables[4], &kTables[5],
                                                        &kTables[6], &kTables[7]};
  return kPointers;
}

}  // namespace plumbline::programs
