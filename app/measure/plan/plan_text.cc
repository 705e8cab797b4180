#include "app/measure/plan/plan_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string>
#include <vector>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::measure {
namespace {

double InFile(const model::JointVector& q, std::size_t joint,
              const std::vector<model::Joint>& joints) {
  return q[static_cast<Eigen::Index>(joint)] * model::PositionForm(joints[joint].type).from_SI;
}

std::string JointNames(const std::vector<model::Joint>& joints, char separator) {
  std::string names;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    names += separator + model::JointColumnName(model::JointQuantity::kPosition, joints[i].type,
                                                static_cast<int>(i));
  }
  return names;
}

/// Two axes of W drawn to the right and upwards, within a square of the picture.
struct View {
  int right = 0, up = 0;
  double left_px = 0;
  Vec3 centre;
  double px_per_m = 1;

  double X(const Vec3& p) const { return left_px + 200 + px_per_m * (p[right] - centre[right]); }
  double Y(const Vec3& p) const { return 230 - px_per_m * (p[up] - centre[up]); }
};

std::string Drawn(const View& view, const MeasurementPlan& plan, const model::CellModel& cell,
                  const char* title) {
  std::string svg = fmt::format(
      "<text x=\"{}\" y=\"20\" font-size=\"14\">{}</text>\n"
      "<rect x=\"{}\" y=\"30\" width=\"400\" height=\"400\" fill=\"none\" stroke=\"#999\"/>\n",
      view.left_px, title, view.left_px);
  const Vec3& base = cell.robot.X_WB.p;
  svg += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"12\" height=\"12\" fill=\"#444\"/>\n",
                     view.X(base) - 6, view.Y(base) - 6);
  for (const model::Artefact& artefact : cell.artefacts) {
    if (!artefact.place) continue;
    const Vec3 p = artefact.in_base ? cell.robot.X_WB * *artefact.place : *artefact.place;
    svg += fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"9\" fill=\"none\" stroke=\"#c60\" "
        "stroke-width=\"2\"/>\n",
        view.X(p), view.Y(p));
  }
  std::string line;
  for (const PlannedRow& row : plan.rows) {
    line += fmt::format("{:.1f},{:.1f} ", view.X(row.X_WT.p), view.Y(row.X_WT.p));
  }
  svg += fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"#bcd\"/>\n", line);
  for (std::size_t i = 0; i < plan.rows.size(); ++i) {
    const Vec3& p = plan.rows[i].X_WT.p;
    svg += fmt::format(
        "<circle cx=\"{0:.1f}\" cy=\"{1:.1f}\" r=\"3\" fill=\"#06c\"/>"
        "<text x=\"{2:.1f}\" y=\"{3:.1f}\" font-size=\"10\">{4}</text>\n",
        view.X(p), view.Y(p), view.X(p) + 4, view.Y(p) - 4, i + 1);
  }
  return svg;
}

}  // namespace

std::string LoadText(const PlannedRow& row) {
  std::vector<std::string> parts;
  if (row.tool_number) parts.push_back(fmt::format("tool {}", *row.tool_number));
  if (row.payload_item) {
    parts.push_back(*row.payload_item == 0 ? "no payload item"
                                           : fmt::format("payload item {}", *row.payload_item));
  }
  if (row.payload_kg) {
    parts.push_back(*row.payload_kg == 0 ? "no payload"
                                         : fmt::format("payload {:g} kg", *row.payload_kg));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string PlanCsv(const MeasurementPlan& plan, const std::vector<model::Joint>& joints) {
  const auto any = [&](auto&& test) { return std::ranges::any_of(plan.rows, test); };
  const bool payload = any([](const PlannedRow& row) { return row.payload_kg.has_value(); });
  const bool artefact = any([](const PlannedRow& row) { return !row.artefact.empty(); });
  std::string text = JointNames(joints, ',').substr(1);
  const bool tool = any([](const PlannedRow& row) { return row.tool_number.has_value(); });
  const bool item = any([](const PlannedRow& row) { return row.payload_item.has_value(); });
  text += fmt::format("{}{}{}{}\n", payload ? ",payload_kg" : "", tool ? ",tool" : "",
                      item ? ",payload_item" : "", artefact ? ",artefact" : "");
  for (const PlannedRow& row : plan.rows) {
    std::string line;
    for (std::size_t k = 0; k < joints.size(); ++k) {
      line += fmt::format("{}{:.5f}", k == 0 ? "" : ",", InFile(row.q, k, joints));
    }
    if (payload) line += fmt::format(",{:g}", row.payload_kg.value_or(0));
    if (tool) line += fmt::format(",{}", row.tool_number.value_or(0));
    if (item) line += fmt::format(",{}", row.payload_item.value_or(0));
    if (artefact) line += "," + row.artefact;
    text += line + '\n';
  }
  return text;
}

std::string UrScript(const MeasurementPlan& plan) {
  std::string text =
      "# Measurement plan of plumbline. Run it at reduced speed first: only what the cell file\n"
      "# declares was checked for collisions. The program moves the robot only where the joint "
      "move\n"
      "# was found free and the tip ends in the air; otherwise it asks to guide the robot.\n"
      "def plumbline_plan():\n";
  for (std::size_t i = 0; i < plan.rows.size(); ++i) {
    const PlannedRow& row = plan.rows[i];
    std::string radians, degrees;
    for (const double q : row.q) {
      radians += fmt::format("{}{:.6f}", radians.empty() ? "" : ", ", q);
      degrees += fmt::format("{}{:.1f}", degrees.empty() ? "" : ", ", kDegPerRad * q);
    }
    if (row.move_checked && row.artefact.empty()) {
      text += fmt::format("  movej([{}], a=0.5, v=0.3)\n  sleep(1.0)\n", radians);
    } else {
      text += fmt::format("  popup(\"Guide the robot to {} deg{}\", blocking=True)\n", degrees,
                          row.artefact.empty() ? "" : ", onto " + row.artefact);
    }
    const std::string load = LoadText(row);
    text += fmt::format("  popup(\"Pose {} of {}: measure{}{}, then continue\", blocking=True)\n",
                        i + 1, plan.rows.size(), row.artefact.empty() ? "" : " at " + row.artefact,
                        load.empty() ? "" : " with " + load);
  }
  return text + "end\n";
}

std::string PointList(const MeasurementPlan& plan, const std::vector<model::Joint>& joints) {
  std::string text = "pose" + JointNames(joints, '\t') +
                     "\tx_mm\ty_mm\tz_mm\troll_deg\tpitch_deg\tyaw_deg\tmove_free\tload\n";
  for (std::size_t i = 0; i < plan.rows.size(); ++i) {
    const PlannedRow& row = plan.rows[i];
    text += fmt::format("{}", i + 1);
    for (std::size_t k = 0; k < joints.size(); ++k) {
      text += fmt::format("\t{:.5f}", InFile(row.q, k, joints));
    }
    for (const double value : row.X_WT.p) text += fmt::format("\t{:.3f}", kMmPerMetre * value);
    const Vec3 rpy = RollPitchYawFromRotation(row.X_WT.R);
    for (const double value : rpy) text += fmt::format("\t{:.4f}", kDegPerRad * value);
    text += fmt::format("\t{}\t{}\n", row.move_checked ? 1 : 0, LoadText(row));
  }
  return text;
}

std::string PlanSvg(const MeasurementPlan& plan, const model::CellModel& cell) {
  Vec3 low = cell.robot.X_WB.p, high = low;
  for (const PlannedRow& row : plan.rows) {
    low = low.cwiseMin(row.X_WT.p);
    high = high.cwiseMax(row.X_WT.p);
  }
  const double span_m = std::max(0.1, (high - low).maxCoeff());
  View top{0, 1, 10, (low + high) / 2, 360 / span_m};
  View side{0, 2, 430, (low + high) / 2, 360 / span_m};
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"840\" height=\"440\" "
         "font-family=\"sans-serif\">\n<rect width=\"840\" height=\"440\" fill=\"white\"/>\n" +
         Drawn(top, plan, cell, "from above (x right, y up)") +
         Drawn(side, plan, cell, "from the side (x right, z up)") + "</svg>\n";
}

}  // namespace plumbline::measure
