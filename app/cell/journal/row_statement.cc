#include "app/cell/journal/row_statement.h"

#include "app/base/config/toml_reader.h"
#include "app/base/text/json_text.h"
#include "app/cell/journal/row_checksum.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::cell {
namespace {

/// Joint values as a JSON array in the units of measured.csv; nullopt if absent.
std::optional<std::string> JointText(const model::JointVector& values,
                                     const std::vector<model::Joint>& joints,
                                     model::JointQuantity quantity) {
  if (values.size() == 0) return std::nullopt;
  nlohmann::json array = nlohmann::json::array();
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const double unit = model::FormOf(quantity, joints[static_cast<std::size_t>(i)].type).to_SI;
    array.push_back(values[i] / unit);
  }
  return text::JsonText(array);
}

bool JointsFromText(const sqlite::Statement& row, int column,
                    const std::vector<model::Joint>& joints, model::JointQuantity quantity,
                    model::JointVector& values) {
  if (row.IsNull(column)) return true;
  const nlohmann::json array = text::JsonOrNull(row.Text(column));
  if (!array.is_array() || array.size() != joints.size()) return false;
  values.resize(static_cast<Eigen::Index>(joints.size()));
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (!array[i].is_number()) return false;
    const double unit = model::FormOf(quantity, joints[i].type).to_SI;
    values[static_cast<Eigen::Index>(i)] = array[i].get<double>() * unit;
  }
  return true;
}

std::optional<std::string> CovarianceText(const std::optional<Mat3>& covariance_m2) {
  if (!covariance_m2) return std::nullopt;
  nlohmann::json array = nlohmann::json::array();
  for (int k = 0; k < 9; ++k) {
    array.push_back((*covariance_m2)(k / 3, k % 3) * kMmPerMetre * kMmPerMetre);
  }
  return text::JsonText(array);
}

/// nullopt if absent, or not an array of nine numbers, which this program never writes.
std::optional<Mat3> CovarianceFrom(const sqlite::Statement& row, int column) {
  if (row.IsNull(column)) return std::nullopt;
  const nlohmann::json array = text::JsonOrNull(row.Text(column));
  if (!array.is_array() || array.size() != 9) return std::nullopt;
  Mat3 covariance;
  for (std::size_t k = 0; k < 9; ++k) {
    if (!array[k].is_number()) return std::nullopt;
    covariance(static_cast<Eigen::Index>(k / 3), static_cast<Eigen::Index>(k % 3)) =
        array[k].get<double>() * kMetrePerMm * kMetrePerMm;
  }
  return covariance;
}

void BindPoint(sqlite::Statement& statement, int index, const std::optional<Vec3>& point_m) {
  for (int k = 0; k < 3; ++k) {
    statement.Bind(index + k, point_m ? std::optional((*point_m)[k] * kMmPerMetre) : std::nullopt);
  }
}

std::optional<Vec3> PointFrom(const sqlite::Statement& row, int column) {
  if (row.IsNull(column)) return std::nullopt;
  return Vec3(kMetrePerMm *
              Vec3(row.Number(column), row.Number(column + 1), row.Number(column + 2)));
}

std::optional<std::int64_t> Widened(const auto& value) {
  return value ? std::optional<std::int64_t>(*value) : std::nullopt;
}

}  // namespace

const char* const kInsertRow =
    "INSERT INTO measurement (source, unix_ms, t_s, session, command, q, qd, qdd, tau, payload_kg,"
    " temp_C, predicted_x_mm, predicted_y_mm, predicted_z_mm, x_mm, y_mm, z_mm, range_mm, qw, qx,"
    " qy, qz, model_version, wild, alarm, q_step_deg, covariance_mm2, camera,"
    " quarantine, artefact, gauge_mm, sigma_mm, tool, payload_item, predicted_radius_mm) VALUES"
    " (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)";

std::string SelectRowsSql() {
  return "SELECT source, unix_ms, t_s, session, command, q, qd, qdd, tau, payload_kg, temp_C,"
         " predicted_x_mm, predicted_y_mm, predicted_z_mm, x_mm, y_mm, z_mm, range_mm, qw, qx, qy, "
         "qz,"
         " model_version, wild, alarm, id, q_step_deg, covariance_mm2, camera, quarantine, "
         "artefact,"
         " gauge_mm, sigma_mm, tool, payload_item, predicted_radius_mm, " +
         IntactSql(kMeasurementTable) + " AS intact FROM measurement";
}

const char* NameOf(JournalRow::Source source) {
  switch (source) {
    case JournalRow::Source::kPlc:
      return "plc";
    case JournalRow::Source::kCamera:
      return "camera";
    case JournalRow::Source::kGauge:
      return "gauge";
    case JournalRow::Source::kImport:
      return "import";
  }
  return "?";
}

JournalRow::Source SourceNamed(std::string_view name) {
  using enum JournalRow::Source;
  for (const JournalRow::Source source : {kPlc, kCamera, kGauge}) {
    if (name == NameOf(source)) return source;
  }
  return kImport;
}

bool InsertRow(sqlite::Statement& statement, const JournalRow& row,
               const std::vector<model::Joint>& joints) {
  statement.Bind(1, std::string(NameOf(row.source)));
  statement.Bind(2, row.unix_ms);
  statement.Bind(3, row.t_s);
  statement.Bind(4, row.session);
  statement.Bind(5, Widened(row.command));
  statement.Bind(6, JointText(row.q, joints, model::JointQuantity::kPosition));
  statement.Bind(7, JointText(row.qd, joints, model::JointQuantity::kVelocity));
  statement.Bind(8, JointText(row.qdd, joints, model::JointQuantity::kAcceleration));
  statement.Bind(9, JointText(row.tau, joints, model::JointQuantity::kTorque));
  statement.Bind(10, row.payload_kg);
  statement.Bind(11, row.temp_C);
  BindPoint(statement, 12, row.predicted_W);
  BindPoint(statement, 15, row.measured_W);
  statement.Bind(18, row.range_m ? std::optional(*row.range_m * kMmPerMetre) : std::nullopt);
  const auto component = [&row](auto part) {
    return row.orientation_W ? std::optional(part(*row.orientation_W)) : std::nullopt;
  };
  statement.Bind(19, component([](const Eigen::Quaterniond& q) { return q.w(); }));
  statement.Bind(20, component([](const Eigen::Quaterniond& q) { return q.x(); }));
  statement.Bind(21, component([](const Eigen::Quaterniond& q) { return q.y(); }));
  statement.Bind(22, component([](const Eigen::Quaterniond& q) { return q.z(); }));
  statement.Bind(23, Widened(row.model_version));
  statement.Bind(24, std::int64_t{row.wild});
  statement.Bind(25, std::int64_t{row.alarm});
  statement.Bind(26, row.q_step_rad ? std::optional(*row.q_step_rad / kRadPerDeg) : std::nullopt);
  statement.Bind(27, CovarianceText(row.covariance_W));
  statement.Bind(28, row.camera.empty() ? std::nullopt : std::optional(row.camera));
  statement.Bind(29, static_cast<std::int64_t>(row.quarantine));
  const auto in_mm = [](const std::optional<double>& length_m) {
    return length_m ? std::optional(*length_m * kMmPerMetre) : std::nullopt;
  };
  statement.Bind(30, row.artefact.empty() ? std::nullopt : std::optional(row.artefact));
  statement.Bind(31, in_mm(row.gauge_m));
  statement.Bind(32, in_mm(row.sigma_m));
  statement.Bind(33, Widened(row.tool_number));
  statement.Bind(34, Widened(row.payload_item));
  statement.Bind(35, in_mm(row.predicted_radius_m));
  return statement.Run();
}

std::optional<JournalRow> RowFrom(const sqlite::Statement& s,
                                  const std::vector<model::Joint>& joints) {
  JournalRow row;
  row.source = SourceNamed(s.Text(0));
  row.unix_ms = s.OptionalIntegerAt(1);
  row.t_s = s.OptionalNumberAt(2);
  row.session = s.Text(3);
  if (!s.IsNull(4)) row.command = static_cast<std::uint16_t>(s.Integer(4));
  const bool joints_fit =
      JointsFromText(s, 5, joints, model::JointQuantity::kPosition, row.q) && row.q.size() > 0 &&
      JointsFromText(s, 6, joints, model::JointQuantity::kVelocity, row.qd) &&
      JointsFromText(s, 7, joints, model::JointQuantity::kAcceleration, row.qdd) &&
      JointsFromText(s, 8, joints, model::JointQuantity::kTorque, row.tau);
  if (!joints_fit) return std::nullopt;
  row.payload_kg = s.OptionalNumberAt(9);
  row.temp_C = s.OptionalNumberAt(10);
  row.predicted_W = PointFrom(s, 11);
  row.measured_W = PointFrom(s, 14);
  if (!s.IsNull(17)) row.range_m = s.Number(17) * kMetrePerMm;
  if (!s.IsNull(18)) {
    row.orientation_W = Eigen::Quaterniond(s.Number(18), s.Number(19), s.Number(20), s.Number(21));
  }
  if (!s.IsNull(22)) row.model_version = static_cast<int>(s.Integer(22));
  row.wild = s.Integer(23) != 0;
  row.alarm = s.Integer(24) != 0;
  row.id = s.Integer(kIdColumn);
  if (const auto step_deg = s.OptionalNumberAt(26)) row.q_step_rad = *step_deg * kRadPerDeg;
  row.covariance_W = CovarianceFrom(s, 27);
  if (!s.IsNull(28)) row.camera = s.Text(28);
  row.quarantine = static_cast<JournalRow::Quarantine>(s.Integer(29));
  if (!s.IsNull(30)) row.artefact = s.Text(30);
  if (const auto gauge_mm = s.OptionalNumberAt(31)) row.gauge_m = *gauge_mm * kMetrePerMm;
  if (const auto sigma_mm = s.OptionalNumberAt(32)) row.sigma_m = *sigma_mm * kMetrePerMm;
  if (!s.IsNull(33)) row.tool_number = static_cast<int>(s.Integer(33));
  if (!s.IsNull(34)) row.payload_item = static_cast<int>(s.Integer(34));
  if (const auto radius_mm = s.OptionalNumberAt(35))
    row.predicted_radius_m = *radius_mm * kMetrePerMm;
  return row;
}

}  // namespace plumbline::cell
