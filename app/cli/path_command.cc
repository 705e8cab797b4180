// plumbline path: corrects a table of poses.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <memory>

#include "app/base/config/fault.h"
#include "app/base/config/wrong_file.h"
#include "app/base/service/utc_clock.h"
#include "app/base/text/text.h"
#include "app/cli/cell_option.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/number_option.h"
#include "app/cli/output_file.h"
#include "app/cli/program_options.h"
#include "app/cli/progress.h"
#include "app/programs/correction/path_corrector.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/text_file.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/loads/numbered_load.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::cli {
namespace {

struct PathOptions {
  std::string cell, path, out, near;
  std::optional<double> payload_kg, temperature_C, deflection_sd;
  std::optional<int> tool;
  bool no_radius = false;
};

/// Columns of a row, by index; -1: absent.
struct Columns {
  std::vector<int> joints;
  std::array<int, 3> position = {-1, -1, -1};
  std::array<int, 4> quaternion = {-1, -1, -1, -1};
  std::array<int, 3> turn = {-1, -1, -1};
  std::array<int, 3> roll_pitch_yaw = {-1, -1, -1};
  int payload = -1, tool = -1, item = -1, temperature = -1, time = -1;
  int count = 0;
  std::vector<std::string> names;  ///< as in the header

  bool has_joints() const { return !joints.empty() && joints.front() >= 0; }
  bool has_pose() const { return position[0] >= 0; }
};

template <std::size_t kSize>
bool Complete(const std::array<int, kSize>& columns) {
  return std::ranges::all_of(columns, [](int column) { return column >= 0; });
}
template <std::size_t kSize>
bool Partial(const std::array<int, kSize>& columns) {
  return !Complete(columns) && std::ranges::any_of(columns, [](int column) { return column >= 0; });
}

std::vector<std::string_view> Cells(std::string_view line) {
  std::vector<std::string_view> cells;
  while (true) {
    const std::size_t comma = std::min(line.find(','), line.size());
    std::string_view cell = line.substr(0, comma);
    while (cell.starts_with(' ') || cell.starts_with('\t')) cell.remove_prefix(1);
    while (cell.ends_with(' ') || cell.ends_with('\t') || cell.ends_with('\r')) {
      cell.remove_suffix(1);
    }
    cells.push_back(cell);
    if (comma == line.size()) return cells;
    line.remove_prefix(comma + 1);
  }
}

/// Columns that only corrected tables have.
constexpr std::array<std::string_view, 2> kOutputColumns = {"correction_mm", "extrapolated"};

Result<Columns> ColumnsOf(std::string_view header, const model::Robot& robot) {
  Columns columns;
  columns.joints.assign(robot.joints.size(), -1);
  if (header.starts_with("\xEF\xBB\xBF")) header.remove_prefix(3);
  const std::vector<std::string_view> names = Cells(header);
  columns.count = static_cast<int>(names.size());
  columns.names.assign(names.begin(), names.end());
  struct Known {
    std::string_view name;
    int* column;
  };
  std::vector<std::string> joint_names;
  std::vector<Known> known = {{"x_mm", &columns.position[0]},
                              {"y_mm", &columns.position[1]},
                              {"z_mm", &columns.position[2]},
                              {"qw", &columns.quaternion[0]},
                              {"qx", &columns.quaternion[1]},
                              {"qy", &columns.quaternion[2]},
                              {"qz", &columns.quaternion[3]},
                              {"rx_deg", &columns.turn[0]},
                              {"ry_deg", &columns.turn[1]},
                              {"rz_deg", &columns.turn[2]},
                              {"roll_deg", &columns.roll_pitch_yaw[0]},
                              {"pitch_deg", &columns.roll_pitch_yaw[1]},
                              {"yaw_deg", &columns.roll_pitch_yaw[2]},
                              {"payload_kg", &columns.payload},
                              {"tool", &columns.tool},
                              {"payload_item", &columns.item},
                              {"temp_C", &columns.temperature},
                              {"t_s", &columns.time}};
  joint_names.reserve(robot.joints.size());
  for (std::size_t i = 0; i < robot.joints.size(); ++i) {
    joint_names.push_back(model::JointColumnName(model::JointQuantity::kPosition,
                                                 robot.joints[i].type, static_cast<int>(i)));
    known.push_back({joint_names.back(), &columns.joints[i]});
  }
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto column = std::ranges::find(known, names[k], &Known::name);
    if (column == known.end()) continue;
    if (*column->column >= 0) {
      return Error{fmt::format("column {} occurs twice", text::Visible(names[k]))};
    }
    *column->column = static_cast<int>(k);
  }
  const auto has = [&](std::string_view name) {
    return std::ranges::find(names, name) != names.end();
  };
  if (has(kOutputColumns[0]) && has(kOutputColumns[1])) {
    return Error{
        fmt::format("has the columns {} and {}: it is already corrected. Give the table of the "
                    "targets",
                    kOutputColumns[0], kOutputColumns[1])};
  }
  const bool some_joints = std::ranges::any_of(columns.joints, [](int c) { return c >= 0; });
  const bool all_joints = std::ranges::all_of(columns.joints, [](int c) { return c >= 0; });
  if (some_joints && !all_joints) return Error{"not all joints have a column"};
  const int orientations = (Complete(columns.quaternion) ? 1 : 0) +
                           (Complete(columns.turn) ? 1 : 0) +
                           (Complete(columns.roll_pitch_yaw) ? 1 : 0);
  const bool partial = Partial(columns.position) || Partial(columns.quaternion) ||
                       Partial(columns.turn) || Partial(columns.roll_pitch_yaw);
  const bool pose = Complete(columns.position) && orientations == 1;
  if (partial || orientations > 1 || (Complete(columns.position) != (orientations == 1)) ||
      (!pose && !all_joints)) {
    return Error{fmt::format(
        "needs {} .. {}, or x_mm, y_mm, z_mm in the robot's base with the orientation as qw, qx, "
        "qy, qz, or rx_deg, ry_deg, rz_deg (rotation vector), or roll_deg, pitch_deg, yaw_deg",
        joint_names.front(), joint_names.back())};
  }
  return columns;
}

class RowReader {
 public:
  RowReader(const PathOptions& options, const model::CellModel& cell, const Columns& columns)
      : options_(options), cell_(cell), columns_(columns) {}

  Result<programs::PathRow> Read(std::string_view line) {
    values_.clear();
    for (const std::string_view cell : Cells(line)) {
      values_.push_back(cell.empty() ? std::nullopt : FiniteNumberFromText(cell));
      if (!cell.empty() && !values_.back()) {
        unreadable_ = std::string(cell);
      }
    }
    if (static_cast<int>(values_.size()) != columns_.count) {
      return Error{fmt::format("has {} cells, the header {}", values_.size(), columns_.count)};
    }
    programs::PathRow row;
    if (columns_.has_joints()) {
      model::JointVector q(cell_.robot.size());
      for (int i = 0; i < q.size(); ++i) {
        const auto value = At(columns_.joints[static_cast<std::size_t>(i)]);
        if (!value) return Missing(columns_.joints[static_cast<std::size_t>(i)]);
        q[i] = *value *
               model::PositionForm(cell_.robot.joints[static_cast<std::size_t>(i)].type).to_SI;
      }
      row.q = q;
    }
    if (columns_.has_pose()) {
      const Result<Pose> pose = ReadPose();
      if (!pose) return pose.failure();
      row.X_BT = *pose;
    }
    const auto payload = At(columns_.payload);
    const auto tool = Number(At(columns_.tool)), item = Number(At(columns_.item));
    const std::optional<double> mass_kg = payload ? payload : options_.payload_kg;
    if (mass_kg && (*mass_kg < 0 || *mass_kg > loads::kMaxPayload_kg)) {
      return Error{
          fmt::format("payload_kg {:g} is outside 0..{:g}", *mass_kg, loads::kMaxPayload_kg)};
    }
    const std::optional<int> number = tool ? tool : options_.tool;
    if (!loads::ToolIndexOf(cell_, number)) {
      return Error{number
                       ? fmt::format("tool {} is not declared", *number)
                       : std::string("the cell has several tools; give a column tool, or --tool")};
    }
    if (item.value_or(0) != 0 && loads::ItemOf(cell_, item) == nullptr) {
      return Error{fmt::format("payload_item {} is not declared", *item)};
    }
    row.payload = loads::LoadOf(cell_, mass_kg, number, item);
    row.temp_C = At(columns_.temperature);
    if (!row.temp_C) row.temp_C = options_.temperature_C;
    row.t_s = At(columns_.time);
    return row;
  }

 private:
  std::optional<double> At(int column) const {
    return column < 0 ? std::nullopt : values_[static_cast<std::size_t>(column)];
  }
  static std::optional<int> Number(const std::optional<double>& value) {
    return value ? std::optional(static_cast<int>(std::lround(*value))) : std::nullopt;
  }
  Error Missing(int column) const {
    return Error{fmt::format("{} is no number{}",
                             text::Visible(columns_.names[static_cast<std::size_t>(column)]),
                             unreadable_.empty() ? "" : ": " + text::Visible(unreadable_))};
  }
  /// The first of the columns without a number.
  template <std::size_t kSize>
  Error FirstMissing(const std::array<int, kSize>& columns) const {
    return Missing(*std::ranges::find_if(columns, [&](int column) { return !At(column); }));
  }
  template <std::size_t kSize>
  std::optional<std::array<double, kSize>> All(const std::array<int, kSize>& columns) const {
    std::array<double, kSize> numbers;
    for (std::size_t k = 0; k < kSize; ++k) {
      const auto value = At(columns[k]);
      if (!value) return std::nullopt;
      numbers[k] = *value;
    }
    return numbers;
  }

  Result<Pose> ReadPose() const {
    const auto p = All(columns_.position);
    if (!p) return FirstMissing(columns_.position);
    Pose pose;
    pose.p = kMetrePerMm * Vec3((*p)[0], (*p)[1], (*p)[2]);
    if (Complete(columns_.quaternion)) {
      const auto n = All(columns_.quaternion);
      if (!n) return FirstMissing(columns_.quaternion);
      const Eigen::Quaterniond quaternion((*n)[0], (*n)[1], (*n)[2], (*n)[3]);
      if (std::abs(quaternion.norm() - 1) > 0.01) return Error{"qw .. qz are no unit quaternion"};
      pose.R = quaternion.normalized().toRotationMatrix();
      return pose;
    }
    const bool turn = Complete(columns_.turn);
    const auto n = All(turn ? columns_.turn : columns_.roll_pitch_yaw);
    if (!n) return FirstMissing(turn ? columns_.turn : columns_.roll_pitch_yaw);
    const Vec3 angles = kRadPerDeg * Vec3((*n)[0], (*n)[1], (*n)[2]);
    pose.R = turn ? RotationFromVector(angles) : RotationFromRollPitchYaw(angles);
    return pose;
  }

  const PathOptions& options_;
  const model::CellModel& cell_;
  const Columns& columns_;
  std::vector<std::optional<double>> values_;
  std::string unreadable_;
};

/// Corrected poses have the columns of the input; joints are always written.
std::string HeaderOf(const Columns& columns, const model::Robot& robot) {
  std::string header = "x_mm,y_mm,z_mm,";
  header += Complete(columns.quaternion)       ? "qw,qx,qy,qz"
            : Complete(columns.roll_pitch_yaw) ? "roll_deg,pitch_deg,yaw_deg"
                                               : "rx_deg,ry_deg,rz_deg";
  for (std::size_t i = 0; i < robot.joints.size(); ++i) {
    header += "," + model::JointColumnName(model::JointQuantity::kPosition, robot.joints[i].type,
                                           static_cast<int>(i));
  }
  return header + ",correction_mm,u_mm,basis,extrapolated,problem\n";
}

void AppendRow(const programs::CorrectedRow& row, const Columns& columns, const model::Robot& robot,
               bool radius, std::string& out) {
  const auto append = std::back_inserter(out);
  const std::size_t orientation = Complete(columns.quaternion) ? 4 : 3;
  if (!row.problem.empty()) {
    out.append(3 + orientation + robot.joints.size() + 3, ',');
    std::string problem = row.problem;
    std::ranges::replace(problem, ',', ';');
    fmt::format_to(append, ",{}\n", problem);
    return;
  }
  const Vec3 p = kMmPerMetre * row.X_BT_command.p;
  fmt::format_to(append, "{:.5f},{:.5f},{:.5f}", p.x(), p.y(), p.z());
  if (Complete(columns.quaternion)) {
    const Eigen::Quaterniond n(row.X_BT_command.R);
    fmt::format_to(append, ",{:.9f},{:.9f},{:.9f},{:.9f}", n.w(), n.x(), n.y(), n.z());
  } else {
    const Vec3 angles = kDegPerRad * (Complete(columns.roll_pitch_yaw)
                                          ? RollPitchYawFromRotation(row.X_BT_command.R)
                                          : VectorFromRotation(row.X_BT_command.R));
    fmt::format_to(append, ",{:.7f},{:.7f},{:.7f}", angles.x(), angles.y(), angles.z());
  }
  const model::JointVector& q = row.correction.q;
  for (int i = 0; i < q.size(); ++i) {
    fmt::format_to(
        append, ",{:.7f}",
        q[i] * model::PositionForm(robot.joints[static_cast<std::size_t>(i)].type).from_SI);
  }
  fmt::format_to(append, ",{:.4f},", kMmPerMetre * row.correction.translation_B.norm());
  if (radius) {
    fmt::format_to(append, "{:.4f},{}", kMmPerMetre * row.correction.uncertainty_m,
                   model::Describe(row.correction.basis));
  } else {
    out += ',';
  }
  fmt::format_to(append, ",{},\n", row.correction.extrapolated ? 1 : 0);
}

int Run(const PathOptions& options) {
  if (OverwritesFile("path", {{"--output", options.out}}, {options.cell, options.path},
                     std::cerr)) {
    return kExitUsage;
  }
  const std::optional<CellInForce> in_force = ReadCellInForce(options.cell);
  if (!in_force) return kExitUsage;
  const model::CellModel& cell = in_force->cell;
  const Result<std::string> text = files::ReadFileUpTo(files::kTableSize, options.path);
  if (!text) {
    return Fail(options.path + ": " + files::ReadErrorText(options.path, text.error()), kExitUsage);
  }
  const std::string_view bytes = *text;
  const std::size_t header_end = std::min(bytes.find('\n'), bytes.size());
  config::FaultList faults;
  if (config::RefuseWrongFile(bytes, options.path, config::kWantedTable, faults)) {
    std::cerr << config::FaultsText(faults);
    return kExitUsage;
  }
  const Result<Columns> columns = ColumnsOf(bytes.substr(0, header_end), cell.robot);
  if (!columns) return Fail(options.path + ":1: " + columns.error(), kExitUsage);
  programs::PathCorrector::Options settings;
  settings.radius = !options.no_radius;
  settings.utc_s = service::SystemUtcSeconds();
  if (!options.near.empty()) {
    settings.near_q = JointsFromText(options.near, cell.robot);
    if (!settings.near_q) {
      return Fail(fmt::format("plumbline path: --near {}: give {} joint values, in degrees or mm",
                              options.near, cell.robot.size()),
                  kExitUsage);
    }
  }
  if (!columns->has_joints() && options.near.empty()) {
    return Fail(fmt::format("{}: the posture of the first row is not known: give --near "
                            "q1,q2,.. (joints near which it is), or columns with the joints",
                            options.path),
                kExitUsage);
  }
  correction::CorrectionLimits limits = in_force->limits;
  if (options.deflection_sd) limits.deviation = {*options.deflection_sd, true};
  if ((columns->payload >= 0 || options.payload_kg) && !cell.payload_cog_F) {
    return Fail(
        options.cell + ": without [payload] cog_mm a payload mass cannot be used; declare it",
        kExitUsage);
  }
  if (columns->payload < 0 && !options.payload_kg) {
    std::cerr << options.path
              << ": warning: no column payload_kg and no --payload; 0 kg is assumed\n";
  }
  programs::PathCorrector corrector(cell, limits, settings);
  RowReader reader(options, cell, *columns);
  std::string out = HeaderOf(*columns, cell.robot);
  out.reserve(bytes.size() * 3);
  Progress progress(std::cerr, false);
  constexpr std::size_t kAtOnce = 512;
  std::size_t rows = 0, left = 0, searched = 0;
  int line = 1;
  programs::CorrectedRow corrected;
  for (std::size_t at = header_end + 1; at < bytes.size();) {
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
    std::string_view text_of_row = bytes.substr(at, end - at);
    at = end + 1;
    ++line;
    if (text_of_row.ends_with('\r')) text_of_row.remove_suffix(1);
    if (text_of_row.empty()) continue;
    if (rows++ % kAtOnce == 0)
      progress.Show(static_cast<double>(at) / static_cast<double>(bytes.size()),
                    fmt::format("{} poses", rows));
    const Result<programs::PathRow> row = reader.Read(text_of_row);
    if (row) {
      corrector.Correct(*row, corrected);
    } else {
      corrected.problem = row.error();
    }
    constexpr std::size_t kMostLines = 20;
    if (!corrected.problem.empty() && ++left <= kMostLines) {
      std::cerr << fmt::format("{}:{}: not corrected: {}\n", options.path, line, corrected.problem);
    }
    searched += corrected.searched && corrected.problem.empty() && rows > 1 ? 1 : 0;
    AppendRow(corrected, *columns, cell.robot, settings.radius, out);
  }
  progress.Clear();
  if (!PrintOrWriteOutput(options.out, out, "--output")) return kExitUsage;
  std::cerr << fmt::format("{}: {} poses corrected, {} not\n",
                           options.out == "-" ? "standard output" : options.out, rows - left, left);
  if (searched > 0) {
    std::cerr << fmt::format(
        "{}: the posture jumps at {} rows: the nearest one to the row before was chosen\n",
        options.path, searched);
  }
  return left == 0 ? kExitOk : kExitFault;
}

}  // namespace

void AddPathCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<PathOptions>();
  CLI::App* command = app.add_subcommand("path", "Correct a table of poses");
  command->add_option("cell", options->cell, "CELL.toml, or the daemon's plumbline.toml")
      ->required();
  command->add_option("path", options->path, "Poses in the order of the motion, PATH.csv")
      ->required();
  command
      ->add_option("--output,--out", options->out,
                   "CSV file for the corrected poses; - is standard output")
      ->required();
  command->add_option("--payload", options->payload_kg, "Payload of rows without payload_kg, kg")
      ->check(NumberWithin(0, loads::kMaxPayload_kg));
  command->add_option("--tool", options->tool, "Number of the [[tool]] of rows without tool")
      ->check(WholeNumberWithin(0, 65535));
  command
      ->add_option("--temperature", options->temperature_C,
                   "Temperature of rows without temp_C, degC")
      ->check(NumberWithin(-50, 150));
  command->add_option("--near", options->near,
                      "Joints near which the first row is, q1,q2,.. in degrees or mm; "
                      "needed for a table without joints");
  command->add_flag("--no-radius", options->no_radius, "Compute no radius");
  command
      ->add_option("--deflection-sd", options->deflection_sd,
                   "Relative standard deviation of the declared deflections [0.1]")
      ->check(NumberWithin(0, 1));
  command->footer(
      "Columns of PATH.csv: x_mm, y_mm, z_mm of the tool's tip in the robot's base, with qw, qx, "
      "qy,\n"
      "qz, or rx_deg, ry_deg, rz_deg (rotation vector), or roll_deg, pitch_deg, yaw_deg; or the "
      "joints\n"
      "q1_deg..; with both, the joints select the posture. Optional: payload_kg, tool, "
      "payload_item,\n"
      "temp_C, t_s. Each row is approached from the one before. The output has the corrected pose "
      "and\n"
      "joints, the 95 % radius u_mm with its basis, and problem where there is no correction. The "
      "radius\n"
      "is computed again after 0.02 rad of any joint, and whenever the load changes.\n\n"
      "Example:\n  plumbline path cell.toml path.csv --near 0,-90,90,-90,-90,0 --out new.csv\n\n"
      "Exit codes: 0 every pose is corrected, 1 some are not, 2 error.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline::cli
