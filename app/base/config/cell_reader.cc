#include "app/base/config/cell_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <vector>

#include "app/base/config/limits.h"
#include "app/base/config/required_file.h"
#include "app/base/config/toml_reader.h"
#include "app/base/config/unlikely_values.h"
#include "app/base/config/wrong_file.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/kinematics/chain.h"
#include "firmware-like/loads/numbered_load.h"
#include "firmware-like/model/cell_model.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::config {
namespace {

// Reader of the payload items of a cell.

/// Reads each [[payload.item]]: its number, mass and centre of gravity. Faults are added to the
/// table's fault list.
std::vector<model::PayloadItem> PayloadItemsFromToml(const TomlTable& payload) {
  std::vector<model::PayloadItem> items;
  std::map<int, int> line_of;
  for (const TomlTable& table : payload.Tables("item")) {
    model::PayloadItem item;
    const auto number = table.RequiredInteger("number", 1, kLargestNumber);
    item.number = number.value_or(item.number);
    item.mass_kg = table.RequiredNumber("mass_kg", {0, loads::kMaxPayload_kg}).value_or(0);
    item.cog_F = table.RequiredVector3("cog_mm", kPlaceRange).value_or(Vec3::Zero());
    if (number) {
      const auto [first, is_new] = line_of.emplace(*number, table.LineOf("number"));
      if (!is_new) {
        table.AddFault("number", fmt::format("is already the number of the item in line {}; give "
                                             "each [[payload.item]] its own",
                                             first->second));
      }
    }
    items.push_back(item);
  }
  return items;
}

constexpr NumberRange kJointAngle{-7200, 7200, kRadPerDeg};
constexpr NumberRange kGravity{-20, 20};
constexpr NumberRange kMass{0, 10000};
constexpr NumberRange kCompliance{0, 0.1};
constexpr NumberRange kCouplingRatio{-1000, 1000};
constexpr NumberRange kOrientationSigma{1e-6, 10, kRadPerDeg};

Pose BasePoseFromToml(const TomlTable& table) {
  Pose X;
  X.p = table.Vector3("base_xyz_mm", kPlaceRange).value_or(Vec3::Zero());
  X.R = RotationFromRollPitchYaw(table.Vector3("base_rpy_deg", kTurnRange).value_or(Vec3::Zero()));
  return X;
}

void ReadLimits(const TomlTable& table, model::Joint& joint) {
  const bool prismatic = joint.type == model::JointType::kPrismatic;
  const char* min_key = prismatic ? "min_mm" : "min_deg";
  const char* max_key = prismatic ? "max_mm" : "max_deg";
  const NumberRange range = prismatic ? kPlaceRange : kJointAngle;
  joint.min = table.Number(min_key, range).value_or(joint.min);
  joint.max = table.Number(max_key, range).value_or(joint.max);
  if (joint.min >= joint.max) {
    table.AddFault(max_key, fmt::format("must be greater than {}", min_key));
  }
}

model::Joint JointFromToml(const TomlTable& table, model::DhConvention convention) {
  model::Joint joint;
  const auto type = table.OneOf<model::JointType>(
      "type",
      {{"revolute", model::JointType::kRevolute}, {"prismatic", model::JointType::kPrismatic}});
  if (!type && table.Has("type")) table.Ignore({"min_deg", "max_deg", "min_mm", "max_mm"});
  joint.type = type.value_or(model::JointType::kRevolute);
  joint.a_m = table.RequiredNumber("a_mm", kPlaceRange).value_or(0);
  joint.alpha_rad = table.RequiredNumber("alpha_deg", kTurnRange).value_or(0);
  joint.beta_rad = table.Number("beta_deg", kTurnRange).value_or(0);
  joint.gamma_rad = table.Number("gamma_deg", kTurnRange).value_or(0);
  if (joint.gamma_rad != 0 && convention == model::DhConvention::kProximal) {
    table.AddFault("gamma_deg",
                   "is allowed with convention = \"dh\" only; add it to theta_offset_deg");
  }
  joint.d_m = table.RequiredNumber("d_mm", kPlaceRange).value_or(0);
  joint.theta_offset_rad = table.Number("theta_offset_deg", kTurnRange).value_or(0);
  joint.sign = table.Integer("sign", -1, 1).value_or(1);
  if (joint.sign == 0) table.AddFault("sign", "must be 1 or -1");
  ReadLimits(table, joint);
  joint.link_mass_kg = table.Number("link_mass_kg", kMass);
  joint.link_com_m = table.Vector3("link_com_mm", kPlaceRange);
  joint.compliance_rad_per_Nm = table.Number("compliance_rad_per_Nm", kCompliance);
  if (joint.type == model::JointType::kPrismatic && table.Has("compliance_rad_per_Nm")) {
    table.AddFault(
        "compliance_rad_per_Nm",
        "does not apply to a prismatic joint; remove it and declare the compliance as an "
        "[[effect]] joint_compliance in m/N");
  }
  return joint;
}

/// Warns about the quantities that the declared masses leave unknown, once per joint.
void WarnAboutUnknowns(const std::vector<TomlTable>& tables,
                       const std::vector<model::Joint>& joints) {
  bool masses_known = true;
  for (std::size_t i = joints.size(); i-- > 0;) {
    const model::Joint& joint = joints[i];
    // A mass that is written but out of range is already a fault.
    masses_known = masses_known && (joint.link_mass_kg || tables[i].Has("link_mass_kg"));
    if (!masses_known && joint.compliance_rad_per_Nm.value_or(0) > 0) {
      tables[i].AddWarning(
          "compliance_rad_per_Nm",
          fmt::format("cannot be used: link_mass_kg of joint {} or of a later joint is missing, so "
                      "the torque is unknown and every correction and prediction is refused",
                      i + 1));
    }
    if (joint.link_mass_kg.value_or(0) > 0 && !joint.link_com_m) {
      tables[i].AddWarning("link_com_mm", "missing; the centre of mass of the link is assumed");
    }
  }
}

/// True if a coupling of CouplingDrive::kReading is to a joint with one of kAxis.
bool MixesDrives(const std::vector<model::JointCoupling>& couplings) {
  using model::CouplingDrive;
  return std::any_of(couplings.begin(), couplings.end(), [&](const model::JointCoupling& outer) {
    return outer.drive == CouplingDrive::kReading &&
           std::any_of(couplings.begin(), couplings.end(), [&](const model::JointCoupling& inner) {
             return inner.joint == outer.of && inner.drive == CouplingDrive::kAxis;
           });
  });
}

/// Reads each [[robot.coupling]]. A coupling with a fault is not returned.
std::vector<model::JointCoupling> CouplingsFromToml(const TomlTable& table,
                                                    const model::Robot& robot) {
  std::vector<model::JointCoupling> couplings;
  for (const TomlTable& row : table.Tables("coupling")) {
    const auto joint = row.RequiredInteger("joint", 1, robot.size());
    const auto of = row.RequiredInteger("of", 1, robot.size());
    const auto ratio = row.RequiredNumber("ratio", kCouplingRatio);
    const auto drive = row.OneOf<model::CouplingDrive>(
        "drive",
        {{"axis", model::CouplingDrive::kAxis}, {"reading", model::CouplingDrive::kReading}});
    if (!joint || !of || !ratio) continue;
    if (*ratio == 0) {
      row.AddFault("ratio", "couples nothing; remove this [[robot.coupling]]");
      continue;
    }
    model::JointCoupling coupling{*joint - 1, *of - 1, *ratio,
                                  drive.value_or(model::CouplingDrive::kAxis)};
    coupling.ratio *= model::CouplingRatioToSI(robot, coupling);
    const bool twice = std::any_of(couplings.begin(), couplings.end(), [&](const auto& other) {
      return other.joint == coupling.joint && other.of == coupling.of;
    });
    couplings.push_back(coupling);
    const bool cycle =
        static_cast<int>(kinematics::CouplingOrder(robot.size(), couplings).size()) < robot.size();
    if (twice) {
      row.AddFault("of", fmt::format("is named twice for joint {}; add the ratios up in one "
                                     "[[robot.coupling]]",
                                     *joint));
    } else if (joint == of) {
      row.AddFault("of", "is the joint itself; name the joint that it turns with");
    } else if (cycle) {
      row.AddFault("of", fmt::format("is itself coupled to joint {}, so neither value follows from "
                                     "the other; remove one [[robot.coupling]]",
                                     *joint));
    } else if (MixesDrives(couplings)) {
      row.AddFault("drive",
                   "differs from that of the coupling that joins the same three joints; "
                   "write the same drive in both");
    }
    if (twice || cycle || MixesDrives(couplings)) couplings.pop_back();
  }
  return couplings;
}

model::Robot RobotFromToml(const TomlTable& table) {
  model::Robot robot;
  robot.name = table.RequiredString("name").value_or("");
  robot.identity = {table.String("model").value_or(""), table.String("series").value_or(""),
                    table.Date("installed").value_or("")};
  robot.convention = table
                         .RequiredOneOf<model::DhConvention>(
                             "convention", {{"dh", model::DhConvention::kDistal},
                                            {"mdh", model::DhConvention::kProximal}})
                         .value_or(model::DhConvention::kDistal);
  if (table.Has("gravity_m_s2")) {
    robot.g_W = table.Vector3("gravity_m_s2", kGravity).value_or(robot.g_W);
    if (robot.g_W.norm() > 20) table.AddFault("gravity_m_s2", "has a magnitude above 20");
    if (robot.g_W.norm() == 0) {
      table.AddWarning("gravity_m_s2", "is zero: no deflection by weight is computed");
    }
  } else {
    table.AddWarning("gravity_m_s2", "missing; [0, 0, -9.80665] is assumed");
    table.Ignore({"gravity_m_s2"});
  }
  robot.X_WB = BasePoseFromToml(table);

  const std::vector<TomlTable> joints = table.Tables("joint");
  if (!table.Has("joint")) table.AddMissing("joint", "one [[robot.joint]] for each joint");
  if (static_cast<int>(joints.size()) > model::kMaxJoints) {
    table.AddFault("joint", fmt::format("is given {} times; at most {} joints", joints.size(),
                                        model::kMaxJoints));
  }
  for (const TomlTable& joint : joints) {
    robot.joints.push_back(JointFromToml(joint, robot.convention));
  }
  if (robot.size() <= model::kMaxJoints && robot.size() > 0) {
    robot.couplings = CouplingsFromToml(table, robot);
  } else {
    table.Ignore({"coupling"});
  }
  WarnAboutUnknowns(joints, robot.joints);
  WarnAboutUnlikelyRobot(table, joints, robot);
  return robot;
}

/// The largest distance of places from the line through two of them [m]; 0 for fewer than three.
double SpreadBesideALine(const std::vector<Vec3>& places) {
  double spread = 0;
  for (std::size_t k = 2; k < places.size(); ++k) {
    for (std::size_t j = 1; j < k; ++j) {
      const Vec3 along = places[j] - places[0];
      if (along.norm() == 0) continue;
      spread = std::max(spread, along.normalized().cross(places[k] - places[0]).norm());
    }
  }
  return spread;
}

void ReadReferenceTags(const TomlTable& table, model::Measurement& measurement) {
  if (!table.Has("reference_tags_mm")) {
    if (table.Has("reference_sd_mm")) {
      table.AddFault("reference_sd_mm", "needs reference_tags_mm, the places of the tags");
    }
    table.Ignore({"reference_sd_mm"});
    return;
  }
  const auto rows = table.Rows("reference_tags_mm", kPlaceRange);
  if (!table.Has("reference_sd_mm")) {
    table.AddMissing("reference_sd_mm", "the standard deviation of each tag's place on one axis");
  }
  measurement.reference_sd_m = table.Number("reference_sd_mm", kSigmaRange).value_or(0);
  if (!rows) return;
  for (Eigen::Index k = 0; k < rows->rows() && rows->cols() == 3; ++k) {
    measurement.reference_tags_W.emplace_back(rows->row(k).transpose());
  }
  constexpr double kMinSpread_m = 0.01, kMetresAsMm = 1e3;
  const double spread_m = SpreadBesideALine(measurement.reference_tags_W);
  double farthest_m = 0;
  for (const Vec3& place : measurement.reference_tags_W) {
    farthest_m = std::max(farthest_m, place.norm());
  }
  constexpr double kLargestCell_m = 50;
  if (spread_m < kMinSpread_m && kMetresAsMm * spread_m >= kMinSpread_m &&
      kMetresAsMm * farthest_m < kLargestCell_m) {
    table.AddFault("reference_tags_mm",
                   fmt::format("looks like metres: no tag is farther than {:.3g} mm from the "
                               "origin. Write mm (a factor of 1000)",
                               farthest_m / kMetrePerMm));
  } else if (spread_m < kMinSpread_m) {
    table.AddFault("reference_tags_mm",
                   "must hold the places [x, y, z] of at least three tags that are not on one "
                   "line: fewer do not define a frame");
  }
}

model::Measurement MeasurementFromToml(const TomlTable& table) {
  model::Measurement measurement;
  const auto kind = table.RequiredOneOf<model::MeasurementKind>(
      "kind", {{"position", model::MeasurementKind::kPosition},
               {"range", model::MeasurementKind::kRange},
               {"pose", model::MeasurementKind::kPose}});
  measurement.kind = kind.value_or(model::MeasurementKind::kPosition);
  if (kind == model::MeasurementKind::kRange) {
    measurement.anchor_W = table.RequiredVector3("anchor_mm", kPlaceRange).value_or(Vec3::Zero());
  } else if (kind && table.Has("anchor_mm")) {
    table.AddFault("anchor_mm", "is allowed with kind = \"range\" only");
  } else {
    table.Ignore({"anchor_mm"});
  }
  measurement.frame_known =
      table.OneOf<bool>("frame", {{"aligned", true}, {"unaligned", false}}).value_or(true);
  measurement.holds_points =
      table.OneOf<bool>("points", {{"cell", false}, {"instrument", true}}).value_or(false);
  if (measurement.holds_points && measurement.frame_known) {
    table.AddFault(
        "points",
        "\"instrument\" is allowed with frame = \"unaligned\" only: an aligned instrument "
        "measures in the cell's frame");
  }
  measurement.tool_known =
      table.OneOf<bool>("tool", {{"known", true}, {"unknown", false}}).value_or(true);
  measurement.sigma_m = table.Number("sigma_mm", kSigmaRange);
  measurement.sigma_rad = table.Number("sigma_deg", kOrientationSigma);
  if (measurement.sigma_rad && !measurement.sigma_m && !table.Has("sigma_mm")) {
    table.AddFault("sigma_deg", "needs sigma_mm, which weights positions against orientations");
  }
  measurement.reference_temperature_C = table.Number("reference_temperature_C", kTemperatureRange);
  if (kind == model::MeasurementKind::kRange && table.Has("camera_xyz_mm")) {
    table.AddFault("camera_xyz_mm",
                   "is not allowed with kind = \"range\": a camera measures no ranges");
    table.Ignore({"camera_rpy_deg"});
  } else if (table.Has("camera_xyz_mm") || table.Has("camera_rpy_deg")) {
    const auto place = table.RequiredVector3("camera_xyz_mm", kPlaceRange);
    const auto turn = table.RequiredVector3("camera_rpy_deg", kTurnRange);
    measurement.X_WC =
        Pose{RotationFromRollPitchYaw(turn.value_or(Vec3::Zero())), place.value_or(Vec3::Zero())};
  } else {
    table.Ignore({"camera_xyz_mm", "camera_rpy_deg"});
  }
  ReadReferenceTags(table, measurement);
  return measurement;
}

/// Reads `tip_mm` of a cell with one tool, or a [[session.tip]] of each tool.
void ReadSessionTips(const TomlTable& table, const model::CellModel& cell,
                     model::SessionFrames& session) {
  const std::optional<Vec3> declared_F = table.Vector3("declared_tip_mm", kPlaceRange);
  const auto single_F = table.Vector3("tip_mm", kPlaceRange);
  if (single_F && cell.tools() > 1) {
    table.AddFault("tip_mm",
                   "belongs to a cell with one tool, and this one has several; write a "
                   "[[session.tip]] with tool and xyz_mm for each");
  } else if (single_F) {
    session.tips.push_back({std::nullopt, *single_F, declared_F});
  } else if (declared_F && !table.Has("tip_mm")) {
    table.AddFault("declared_tip_mm",
                   "is the declared tip beside tip_mm, which is missing; add "
                   "tip_mm or remove it");
  }
  for (const TomlTable& own : table.Tables("tip")) {
    const std::optional<int> number = own.RequiredInteger("tool", 0, kLargestNumber);
    const auto p_F = own.RequiredVector3("xyz_mm", kPlaceRange);
    const auto own_declared_F = own.Vector3("declared_xyz_mm", kPlaceRange);
    if (!number || !p_F) continue;
    const bool second = std::any_of(
        session.tips.begin(), session.tips.end(),
        [&](const model::SessionTip& other) { return !other.tool || other.tool == number; });
    if (second) own.AddFault("tool", "has two tips in one session");
    if (!loads::ToolIndexOf(cell, number)) own.AddFault("tool", "is not the number of a [[tool]]");
    session.tips.push_back({number, *p_F, own_declared_F});
  }
}

std::vector<model::SessionFrames> SessionsFromToml(const TomlTable& root,
                                                   const model::CellModel& cell) {
  const Pose& X_WB = cell.robot.X_WB;
  std::vector<model::SessionFrames> sessions;
  for (const TomlTable& table : root.Tables("session")) {
    model::SessionFrames session;
    session.id = table.RequiredString("id").value_or("");
    const bool known = std::any_of(sessions.begin(), sessions.end(),
                                   [&](const auto& other) { return other.id == session.id; });
    if (known && !session.id.empty()) table.AddFault("id", "is used for two sessions");
    const Pose read = BasePoseFromToml(table);
    session.X_WB.p = table.Has("base_xyz_mm") ? read.p : X_WB.p;
    session.X_WB.R = table.Has("base_rpy_deg") ? read.R : X_WB.R;
    ReadSessionTips(table, cell, session);
    if (const auto place = table.Vector3("declared_base_xyz_mm", kPlaceRange)) {
      session.X_WB_declared = Pose{session.X_WB.R, *place};
    }
    if (const auto rpy = table.Vector3("declared_base_rpy_deg", kTurnRange)) {
      if (!session.X_WB_declared) session.X_WB_declared = session.X_WB;
      session.X_WB_declared->R = RotationFromRollPitchYaw(*rpy);
    }
    sessions.push_back(std::move(session));
  }
  return sessions;
}

/// Adds a fault if an effect needs a measuring camera and none is declared.
void RequireCameraPose(const TomlTable& root, const model::CellModel& cell) {
  for (const model::WrittenEffect& written : cell.effects) {
    const effects::Effect* effect = effects::FindEffect(written.id);
    if (effect == nullptr || !effect->traits().Needs(effects::Signal::kCamera)) continue;
    if (cell.measurement.X_WC) continue;
    root.AddFault("effect", fmt::format("{} is an effect of a measuring camera; give [measurement] "
                                        "camera_xyz_mm and camera_rpy_deg",
                                        written.id));
  }
}

/// Tools, payload and payload items.
void ReadLoads(const TomlTable& root, model::CellModel& cell) {
  std::vector<model::Tool> tools = ToolsFromToml(root);
  if (!tools.empty()) {
    cell.tool = std::move(tools.front());
    cell.further_tools.assign(std::make_move_iterator(tools.begin() + 1),
                              std::make_move_iterator(tools.end()));
  }
  if (const auto payload = root.Table("payload")) {
    cell.payload_items = PayloadItemsFromToml(*payload);
    // Items have centres of their own, so that a cell with items needs none for a payload.
    cell.payload_cog_F = payload->Has("item") ? payload->Vector3("cog_mm", kPlaceRange)
                                              : payload->RequiredVector3("cog_mm", kPlaceRange);
  } else if (!root.Has("payload")) {
    root.AddWarning("payload", "missing; payload masses cannot be used");
  }
}

model::CellModel CellFromToml(TomlDocument& document) {
  const TomlTable root = document.Root();
  model::CellModel cell;
  const auto schema = root.RequiredInteger("schema", 0, 1000000);
  if (schema && *schema != 1 && *schema != 2) {
    root.AddFault("schema", "must be 1 or 2, the schemas that this version supports");
  }
  if (const auto robot = root.RequiredTable("robot")) cell.robot = RobotFromToml(*robot);
  ReadLoads(root, cell);
  if (const auto measurement = root.Table("measurement")) {
    cell.measurement = MeasurementFromToml(*measurement);
  }
  cell.artefacts = ArtefactsFromToml(root);
  cell.distances = DistancesFromToml(root, cell.artefacts);
  if (schema && *schema < 2 && (root.Has("artefact") || root.Has("distance"))) {
    root.AddFault("schema", "must be 2 for a cell with [[artefact]] or [[distance]]");
  }
  for (const TomlTable& effect : root.Tables("effect")) {
    cell.effects.push_back(
        EffectFromToml(effect, cell.robot.size(), effects::PrismaticJoints(cell.robot)));
  }
  RequireCameraPose(root, cell);
  WarnAboutUnlikelyLoad(root, cell);
  cell.sessions = SessionsFromToml(root, cell);
  if (const auto domain = root.Table("domain")) {
    cell.domain = DomainFromToml(*domain, cell.robot, document);
  }
  return cell;
}

}  // namespace

std::optional<model::CellModel> CellFromText(std::string_view text, const std::string& file,
                                             FaultList& faults) {
  if (RefuseWrongFile(text, file, kWantedCell, faults)) return std::nullopt;
  return ReadDocument(text, file, faults, CellFromToml);
}

std::optional<model::CellModel> ReadCell(const std::string& path, FaultList& faults) {
  const auto text = ReadRequiredFile(path, faults);
  return text ? CellFromText(*text, path, faults) : std::nullopt;
}

}  // namespace plumbline::config
