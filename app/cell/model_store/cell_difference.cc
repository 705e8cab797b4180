#include "app/cell/model_store/cell_difference.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "app/base/config/cell_reader.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::cell {
namespace {

constexpr double kPaPerGPa = 1e9;

/// A value of a cell: `exact` is compared, `shown` is displayed.
struct Entry {
  std::string key, exact, shown;
};

/// Collects a cell's values. Each struct is decomposed by a structured binding of all its members,
/// so that a new member breaks the build here until it is compared, too.
class Values {
 public:
  std::vector<Entry> entries;

  void Word(const std::string& key, const std::string& word) {
    entries.push_back({key, word, '"' + word + '"'});
  }
  void Flag(const std::string& key, bool on) { Raw(key, on ? "true" : "false"); }
  /// @param to_file  factor from SI to the unit of the key
  void Number(const std::string& key, double si, double to_file = 1) {
    entries.push_back({key, fmt::format("{}", si), Shown(si * to_file)});
  }
  void Number(const std::string& key, const std::optional<double>& si, double to_file = 1) {
    if (si) Number(key, *si, to_file);
  }
  template <typename Vector>
  void List(const std::string& key, const Vector& si, double to_file = 1) {
    std::vector<std::string> exact, shown;
    for (Eigen::Index i = 0; i < si.size(); ++i) {
      exact.push_back(fmt::format("{}", si[i]));
      shown.push_back(Shown(si[i] * to_file));
    }
    entries.push_back({key, fmt::format("{}", fmt::join(exact, " ")),
                       fmt::format("[{}]", fmt::join(shown, ", "))});
  }
  void List(const std::string& key, const std::optional<Vec3>& si, double to_file = 1) {
    if (si) List<Vec3>(key, *si, to_file);
  }
  void Range(const std::string& key, const model::Interval& si, double to_file = 1) {
    List(key, Eigen::Vector2d(si.low, si.high), to_file);
  }
  void Matrix(const std::string& key, const Eigen::MatrixXd& matrix) {
    if (matrix.size() == 0) return;
    std::string exact = fmt::format("{}x{}", matrix.rows(), matrix.cols());
    for (const double value : matrix.reshaped()) exact += fmt::format(" {}", value);
    entries.push_back({key, exact, fmt::format("({} x {} numbers)", matrix.rows(), matrix.cols())});
  }
  /// @param what  "base", "camera": the first word of both keys
  void Place(const std::string& what, const Pose& X) {
    List<Vec3>(what + "_xyz_mm", X.p, 1 / kMetrePerMm);
    List<Vec3>(what + "_rpy_deg", RollPitchYawFromRotation(X.R), 1 / kRadPerDeg);
  }
  void Raw(const std::string& key, const std::string& value) {
    entries.push_back({key, value, value});
  }

 private:
  static std::string Shown(double value) { return fmt::format("{:.9g}", value); }
};

std::string Numbered(const std::string& path, std::size_t index) {
  return fmt::format("{}[{}]", path, index + 1);
}

void Add(Values& values, const std::string& at, const model::Joint& joint) {
  const auto& [type, a_m, alpha_rad, beta_rad, gamma_rad, d_m, theta_offset_rad, sign, min, max,
               link_mass_kg, link_com_m, compliance_rad_per_Nm] = joint;
  const bool prismatic = type == model::JointType::kPrismatic;
  values.Word(at + ".type", prismatic ? "prismatic" : "revolute");
  values.Number(at + ".a_mm", a_m, 1 / kMetrePerMm);
  values.Number(at + ".alpha_deg", alpha_rad, 1 / kRadPerDeg);
  values.Number(at + ".beta_deg", beta_rad, 1 / kRadPerDeg);
  values.Number(at + ".gamma_deg", gamma_rad, 1 / kRadPerDeg);
  values.Number(at + ".d_mm", d_m, 1 / kMetrePerMm);
  values.Number(at + ".theta_offset_deg", theta_offset_rad, 1 / kRadPerDeg);
  values.Number(at + ".sign", sign);
  const double to_file = 1 / (prismatic ? kMetrePerMm : kRadPerDeg);
  const std::string unit = prismatic ? "_mm" : "_deg";
  if (std::isfinite(min)) values.Number(at + ".min" + unit, min, to_file);
  if (std::isfinite(max)) values.Number(at + ".max" + unit, max, to_file);
  values.Number(at + ".link_mass_kg", link_mass_kg);
  values.List(at + ".link_com_mm", link_com_m, 1 / kMetrePerMm);
  // Absent and 0 both mean a rigid joint.
  if (compliance_rad_per_Nm.value_or(0) != 0) {
    values.Number(at + ".compliance_rad_per_Nm", compliance_rad_per_Nm);
  }
}

void Add(Values& values, const model::Robot& robot) {
  const auto& [name, convention, g_W, X_WB, joints, couplings, identity] = robot;
  static_cast<void>(name);  // labels, not compared
  static_cast<void>(identity);
  values.Word("robot.convention", convention == model::DhConvention::kDistal ? "dh" : "mdh");
  values.List<Vec3>("robot.gravity_m_s2", g_W);
  values.Place("robot.base", X_WB);
  for (std::size_t i = 0; i < joints.size(); ++i) {
    Add(values, Numbered("robot.joint", i), joints[i]);
  }
  for (const model::JointCoupling& coupling : couplings) {
    const std::string at =
        fmt::format("robot.coupling (joint {} of {})", coupling.joint + 1, coupling.of + 1);
    values.Number(at + ".ratio", coupling.ratio, 1 / model::CouplingRatioToSI(robot, coupling));
    values.Word(at + ".drive", coupling.drive == model::CouplingDrive::kAxis ? "axis" : "reading");
  }
}

/// Compares a section by its beam properties, because the file may specify it in several ways.
void Add(Values& values, const std::string& at, const model::ToolSegment& segment) {
  const auto& [length_m, section, material] = segment;
  const auto& [area_m2, ix_m4, iy_m4, shear_x, shear_y, reach_x_m, reach_y_m, round,
               peak_shear_x_m2, peak_shear_y_m2] = section;
  const auto& [youngs_modulus_Pa, poisson_ratio, density_kg_m3, yield_strength_Pa] = material;
  constexpr double kMm2 = 1e6, kMm4 = 1e12;  // from SI
  values.Number(at + ".length_mm", length_m, 1 / kMetrePerMm);
  values.Number(at + ".area_mm2", area_m2, kMm2);
  values.Number(at + ".ix_mm4", ix_m4, kMm4);
  values.Number(at + ".iy_mm4", iy_m4, kMm4);
  values.Number(at + " (shear coefficient along x)", shear_x);
  values.Number(at + " (shear coefficient along y)", shear_y);
  values.Number(at + " (outermost fibre along x, mm)", reach_x_m, 1 / kMetrePerMm);
  values.Number(at + " (outermost fibre along y, mm)", reach_y_m, 1 / kMetrePerMm);
  values.Flag(at + " (round)", round);
  values.Number(at + " (shear stress area along x, mm2)", peak_shear_x_m2, kMm2);
  values.Number(at + " (shear stress area along y, mm2)", peak_shear_y_m2, kMm2);
  values.Number(at + ".youngs_modulus_GPa", youngs_modulus_Pa, 1 / kPaPerGPa);
  values.Number(at + ".poisson_ratio", poisson_ratio);
  values.Number(at + ".density_kg_m3", density_kg_m3);
  values.Number(at + ".yield_MPa", yield_strength_Pa, 1e-6);
}

void Add(Values& values, const std::string& at, const model::Tool& tool) {
  const auto& [rigid, tcp_F, theory, segments, mount_mass_kg, number] = tool;
  values.Word(at + ".model", rigid                                          ? "rigid"
                             : theory == model::BeamTheory::kEulerBernoulli ? "euler_bernoulli"
                                                                            : "timoshenko");
  values.List<Vec3>(at + ".tcp_mm", tcp_F, 1 / kMetrePerMm);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    Add(values, Numbered(at + ".segment", i), segments[i]);
  }
  values.Number(at + ".mount_mass_kg", mount_mass_kg);
  if (number) values.Number(at + ".number", *number);
}

void Add(Values& values, const model::Measurement& measurement) {
  const auto& [kind, anchor_W, frame_known, holds_points, tool_known, sigma_m, sigma_rad,
               reference_temperature_C, X_WC, reference_tags_W, reference_sd_m] = measurement;
  values.Word("measurement.kind", kind == model::MeasurementKind::kPosition ? "position"
                                  : kind == model::MeasurementKind::kRange  ? "range"
                                                                            : "pose");
  values.List<Vec3>("measurement.anchor_mm", anchor_W, 1 / kMetrePerMm);
  values.Word("measurement.frame", frame_known ? "aligned" : "unaligned");
  values.Word("measurement.points", holds_points ? "instrument" : "cell");
  values.Word("measurement.tool", tool_known ? "known" : "unknown");
  values.Number("measurement.sigma_mm", sigma_m, 1 / kMetrePerMm);
  values.Number("measurement.sigma_deg", sigma_rad, 1 / kRadPerDeg);
  values.Number("measurement.reference_temperature_C", reference_temperature_C);
  if (X_WC) values.Place("measurement.camera", *X_WC);
  for (std::size_t i = 0; i < reference_tags_W.size(); ++i) {
    values.List<Vec3>(Numbered("measurement.reference_tags_mm", i), reference_tags_W[i],
                      1 / kMetrePerMm);
  }
  values.Number("measurement.reference_sd_mm", reference_sd_m, 1 / kMetrePerMm);
}

void Add(Values& values, const std::string& at, const model::Artefact& artefact) {
  const auto& [name, kind, place, direction, radius_m, sd_m, in_base] = artefact;
  const char* const kinds[] = {"point", "sphere", "plane", "gauge"};
  values.Word(at + ".name", name);
  values.Word(at + ".kind", kinds[static_cast<std::size_t>(kind)]);
  values.List(at + ".xyz_mm", place, 1 / kMetrePerMm);
  values.List(at + " (normal or direction)", direction);
  values.Number(at + ".radius_mm", radius_m, 1 / kMetrePerMm);
  values.Number(at + ".sd_mm", sd_m, 1 / kMetrePerMm);
  values.Word(at + ".frame", in_base ? "base" : "measurement");
}

void Add(Values& values, const std::string& at, const model::KnownDistance& distance) {
  const auto& [first, second, value_m, sd_m] = distance;
  values.Number(at + " (first artefact)", first + 1);
  values.Number(at + " (second artefact)", second + 1);
  values.Number(at + ".value_mm", value_m, 1 / kMetrePerMm);
  values.Number(at + ".sd_mm", sd_m, 1 / kMetrePerMm);
}

void Add(Values& values, const std::string& at, const model::WrittenEffect& effect) {
  const auto& [id, scope, parameters, covariance, drivers, nodes, seen_t_s, from_file, from_date,
               from_rows] = effect;
  static_cast<void>(from_file);  // the origin does not affect corrections
  static_cast<void>(from_date);
  static_cast<void>(from_rows);
  values.Word(at + ".id", id);
  values.Word(at + ".scope", fmt::format("{}", fmt::join(scope, ", ")));
  for (const model::EffectParameter& parameter : parameters) {
    const auto& [name, value, sd, unit, word] = parameter;
    const std::string key = fmt::format("{}.{}", at, name);
    if (!word.empty()) {
      values.Word(key, word);
      continue;
    }
    values.Number(key, value);
    values.Number(key + " (sd)", sd);
    values.Word(key + " (unit)", unit);
  }
  values.Matrix(at + ".covariance", covariance);
  values.Word(at + ".drivers", fmt::format("{}", fmt::join(drivers, ", ")));
  values.Matrix(at + ".nodes", nodes);
  if (seen_t_s) values.Range(at + " (t_s it was fitted to)", *seen_t_s);
}

void Add(Values& values, const std::string& at, const model::SessionFrames& session) {
  const auto& [id, X_WB, tips, X_WB_declared] = session;
  values.Word(at + ".id", id);
  values.Place(at + ".base", X_WB);
  for (const auto& [tool, p_F, declared_F] : tips) {
    const std::string of_tool = tool ? fmt::format("{}.tool {}.", at, *tool) : at + ".";
    values.List(of_tool + "tip_mm", std::optional(p_F), 1 / kMetrePerMm);
    values.List(of_tool + "declared_tip_mm", declared_F, 1 / kMetrePerMm);
  }
  if (X_WB_declared) values.Place(at + ".declared_base", *X_WB_declared);
}

void Add(Values& values, const model::Domain& domain, const std::vector<model::Joint>& joints) {
  const auto& [q, payload_kg, temp_C, t_s, torques, largest_residual_m, residual_sigma_m,
               distant_sigma_m, covariance_share, poses, range_growth_m, reach_rad,
               declared_sigma_m, applied_share, time_zero_s, as_validated, tools, payload_items] =
      domain;
  for (std::size_t i = 0; i < q.size(); ++i) {
    const bool prismatic = i < joints.size() && joints[i].type == model::JointType::kPrismatic;
    values.Range(Numbered("domain.q_deg", i), q[i], 1 / (prismatic ? kMetrePerMm : kRadPerDeg));
  }
  const auto add_range = [&](const std::string& at, const model::MeasuredRange& measured,
                             const char* growth_unit, double from_SI = 1 / kMetrePerMm) {
    for (std::size_t i = 0; i < measured.intervals.size(); ++i)
      values.Range(measured.intervals.size() > 1 ? Numbered(at, i) : at, measured.intervals[i]);
    values.Number(fmt::format("{} (growth, {})", at, growth_unit), measured.growth, from_SI);
  };
  for (const model::MeasuredTorque& torque : torques)
    add_range(fmt::format("domain.torques_Nm (q{})", torque.joint + 1), torque.range, "mm/Nm");
  if (payload_kg) add_range("domain.payload_kg", *payload_kg, "mm/kg");
  if (temp_C) add_range("domain.temp_C", *temp_C, "mm/K");
  if (t_s) add_range("domain.t_s", *t_s, "mm/h", 3600 / kMetrePerMm);
  values.Number("domain.largest_residual_mm", largest_residual_m, 1 / kMetrePerMm);
  values.Number("domain.residual_sigma_mm", residual_sigma_m, 1 / kMetrePerMm);
  values.Number("domain.distant_sigma_mm", distant_sigma_m, 1 / kMetrePerMm);
  if (covariance_share < 1) values.Number("domain.covariance_share", covariance_share);
  values.Number("domain.range_growth_mm", range_growth_m, 1 / kMetrePerMm);
  if (reach_rad > 0) values.Number("domain.reach_rad", reach_rad);
  values.Number("domain.declared_sigma_mm", declared_sigma_m, 1 / kMetrePerMm);
  if (applied_share < 1) values.Number("domain.applied_share", applied_share);
  Eigen::MatrixXd of_poses(joints.size(), poses.size());
  for (std::size_t k = 0; k < poses.size(); ++k) of_poses.col(static_cast<int>(k)) = poses[k];
  values.Matrix("domain.poses_deg", of_poses);
  values.Number("domain.time_zero_utc (s since 1970)", time_zero_s);
  if (!tools.empty()) values.Raw("domain.tools", fmt::format("[{}]", fmt::join(tools, ", ")));
  if (payload_items) {
    values.Raw("domain.payload_items", fmt::format("[{}]", fmt::join(*payload_items, ", ")));
  }
  if (!as_validated) values.Flag("domain (model changed after its fit)", true);
}

std::vector<Entry> EntriesOf(const model::CellModel& cell) {
  const auto& [robot, tool, further_tools, payload_cog_F, payload_items, measurement, artefacts,
               distances, effects, sessions, domain] = cell;
  Values values;
  Add(values, robot);
  Add(values, "tool", tool);
  for (std::size_t i = 0; i < further_tools.size(); ++i) {
    Add(values, Numbered("tool", i + 1), further_tools[i]);
  }
  values.List("payload.cog_mm", payload_cog_F, 1 / kMetrePerMm);
  for (std::size_t i = 0; i < payload_items.size(); ++i) {
    const auto& [number, mass_kg, cog_F] = payload_items[i];
    const std::string at = Numbered("payload.item", i);
    values.Number(at + ".number", number);
    values.Number(at + ".mass_kg", mass_kg);
    values.List<Vec3>(at + ".cog_mm", cog_F, 1 / kMetrePerMm);
  }
  Add(values, measurement);
  for (std::size_t i = 0; i < artefacts.size(); ++i) {
    Add(values, Numbered("artefact", i), artefacts[i]);
  }
  for (std::size_t i = 0; i < distances.size(); ++i) {
    Add(values, Numbered("distance", i), distances[i]);
  }
  for (std::size_t i = 0; i < effects.size(); ++i) Add(values, Numbered("effect", i), effects[i]);
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    Add(values, Numbered("session", i), sessions[i]);
  }
  if (domain) Add(values, *domain, robot.joints);
  return values.entries;
}

const Entry* Find(const std::vector<Entry>& entries, const std::string& key) {
  const auto found = std::find_if(entries.begin(), entries.end(),
                                  [&key](const Entry& entry) { return entry.key == key; });
  return found == entries.end() ? nullptr : &*found;
}

/// Shows all digits in SI if the values agree in the nine that are normally shown.
std::string Change(const Entry& before, const Entry& after) {
  const bool alike = before.shown == after.shown;
  return fmt::format("{} {} -> {}{}", before.key, before.shown, after.shown,
                     alike ? fmt::format(" (in SI {} -> {})", before.exact, after.exact) : "");
}

}  // namespace

std::vector<std::string> CellDifferences(const model::CellModel& before,
                                         const model::CellModel& after) {
  const std::vector<Entry> old_entries = EntriesOf(before), new_entries = EntriesOf(after);
  std::vector<std::string> differences;
  for (const Entry& entry : old_entries) {
    const Entry* const now = Find(new_entries, entry.key);
    if (now == nullptr) {
      differences.push_back(fmt::format("{} {} -> absent", entry.key, entry.shown));
    } else if (now->exact != entry.exact) {
      differences.push_back(Change(entry, *now));
    }
  }
  for (const Entry& entry : new_entries) {
    if (Find(old_entries, entry.key) != nullptr) continue;
    differences.push_back(fmt::format("{} absent -> {}", entry.key, entry.shown));
  }
  return differences;
}

std::vector<std::string> CellTextDifferences(const std::string& before, const std::string& after) {
  if (before == after) return {};
  config::FaultList ignored;  // reported when the file is read for use
  const auto cell_before = config::CellFromText(before, "", ignored);
  const auto cell_after = config::CellFromText(after, "", ignored);
  if (cell_before && cell_after) return CellDifferences(*cell_before, *cell_after);
  return {
      "the text (values cannot be compared, because this version cannot read one of the two as a "
      "cell)"};
}

}  // namespace plumbline::cell
