#include "app/programs/correction/program_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "app/base/text/text.h"
#include "app/measure/report/html.h"
#include "app/programs/correction/path_picture.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::programs {
namespace {

std::string NameOf(const Point& point) {
  return point.name.empty() ? std::string("(in the motion)") : text::Visible(point.name);
}

std::string CountText(std::size_t count, const char* thing) {
  return fmt::format("{} {}{}", count, thing, count == 1 ? "" : "s");
}

/// A posture in degrees, or mm for prismatic joints.
std::vector<double> InFileUnits(const model::Robot& robot, const model::JointVector& q) {
  std::vector<double> values;
  for (int i = 0; i < q.size(); ++i) {
    const model::JointType type = robot.joints[static_cast<std::size_t>(i)].type;
    values.push_back(q[i] * model::PositionForm(type).from_SI);
  }
  return values;
}

std::string LimitText(const ReportInput& input, const PointCorrection& point) {
  if (point.limit.joint < 0) return "none";
  const model::JointType type =
      input.cell.robot.joints[static_cast<std::size_t>(point.limit.joint)].type;
  return fmt::format("{:.1f} {} of q{}", point.limit.distance * model::PositionForm(type).from_SI,
                     model::PositionForm(type).unit, point.limit.joint + 1);
}

enum class Outcome { kCorrected, kUnused, kByChoice, kLeft };

Outcome OutcomeOf(const ReportInput& input, const PointCorrection& point) {
  if (point.reason.empty()) return Outcome::kCorrected;
  const bool used =
      std::ranges::any_of(input.correction.flow.uses[point.point],
                          [](const PointUse& use) { return use.role != PointUse::Role::kOther; });
  if (!used) return Outcome::kUnused;
  const Point& source = input.program.points[point.point];
  const bool before = source.place.file < input.corrected_before.size() &&
                      input.corrected_before[source.place.file];
  const bool joints = source.kind == PointKind::kJoints && !input.joints;
  return before || joints ? Outcome::kByChoice : Outcome::kLeft;
}

/// A motion whose target is no point of the files.
struct LeftMotion {
  Place place;
  std::string target, reason;
};

std::vector<LeftMotion> LeftMotionsOf(const ReportInput& input) {
  std::vector<LeftMotion> list;
  for (const MotionAt& at : input.correction.flow.motions) {
    if (at.motion->end.point) continue;
    std::string reason = at.motion->special;
    if (reason.empty()) reason = at.motion->end.missing;
    if (reason.empty()) reason = at.motion->end.offset.unknown;
    if (reason.empty()) reason = "its target is computed while the program runs";
    list.push_back({at.place, text::Visible(at.motion->end.computed), std::move(reason)});
  }
  return list;
}

std::string NameOf(const LeftMotion& motion) {
  return motion.target.empty() ? std::string("the motion") : "the motion to " + motion.target;
}

/// Untouched points with the same reason at the same line, as one entry.
struct Left {
  Place place;
  std::string names, reason;
};

std::vector<Left> LeftOf(const ReportInput& input) {
  constexpr std::size_t kMostNames = 60;
  std::vector<Left> list;
  for (const PointCorrection& point : input.correction.points) {
    if (point.reason.empty()) continue;
    const std::string name = NameOf(input.program.points[point.point]);
    const bool again = !list.empty() && list.back().reason == point.reason &&
                       list.back().place.file == point.reason_place.file &&
                       list.back().place.line == point.reason_place.line;
    if (!again) {
      list.push_back({point.reason_place, name, point.reason});
    } else if (list.back().names.size() < kMostNames) {
      list.back().names += ", " + name;
    } else if (!list.back().names.ends_with(", ..")) {
      list.back().names += ", ..";
    }
  }
  return list;
}

/// What was assumed about tools, a line for each.
std::vector<std::string> ToolAssumptionsOf(const ReportInput& input) {
  std::set<std::string> texts;
  for (const PointCorrection& point : input.correction.points) {
    if (point.reason.empty() && !point.context.tool_assumption.empty()) {
      texts.insert(text::Visible(point.context.tool_assumption));
    }
  }
  return {texts.begin(), texts.end()};
}

double LargestBetween(const ProgramCorrection& correction) {
  double largest_m = 0;
  for (const SegmentDeviation& segment : correction.segments) {
    largest_m = std::max(largest_m, segment.largest_m);
  }
  return largest_m;
}

/// A line for each motion whose path could not be refined.
std::vector<std::string> UnrefinedOf(const ReportInput& input) {
  std::vector<std::string> lines;
  for (const SegmentDeviation& segment : input.correction.segments) {
    if (segment.note.empty()) continue;
    const MotionAt& motion = input.correction.flow.motions[segment.motion];
    lines.push_back(fmt::format(
        "{}: this {} leaves its path by {:.3f} mm{}: {}", PlaceText(input.program, motion.place),
        motion.motion->kind == MotionKind::kCircular ? "circular motion" : "motion",
        kMmPerMetre * segment.largest_m, segment.inserted > 0 ? " after insertion" : "",
        segment.note));
  }
  return lines;
}

std::string SegmentsText(const ReportInput& input) {
  const auto& segments = input.correction.segments;
  if (segments.empty()) return "";
  const auto worst = std::ranges::max_element(segments, {}, &SegmentDeviation::largest_m);
  std::size_t inserted = 0;
  for (const SegmentDeviation& one : segments) inserted += static_cast<std::size_t>(one.inserted);
  return fmt::format(
      "between points: at most {:.3f} mm from the programmed path in {} ({}){}\n",
      kMmPerMetre * worst->largest_m, CountText(segments.size(), "linear or circular motion"),
      PlaceText(input.program, input.correction.flow.motions[worst->motion].place),
      inserted > 0 ? fmt::format("; {} inserted", CountText(inserted, "motion")) : std::string());
}

}  // namespace

ReportCounts CountsOf(const ReportInput& input) {
  ReportCounts counts;
  for (const PointCorrection& point : input.correction.points) {
    ++counts.points;
    switch (OutcomeOf(input, point)) {
      case Outcome::kUnused:
        ++counts.unused;
        continue;
      case Outcome::kByChoice:
        ++counts.by_choice;
        continue;
      case Outcome::kLeft:
        ++counts.left;
        continue;
      case Outcome::kCorrected:
        ++counts.corrected;
    }
    counts.changed += point.edits.empty() ? 0 : 1;
    counts.largest_before_m =
        std::max(counts.largest_before_m, (point.before_B - point.target_B).norm());
    counts.largest_after_m =
        std::max(counts.largest_after_m, (point.after_B - point.target_B).norm());
    counts.largest_rounding_m = std::max(counts.largest_rounding_m, point.rounding_m);
  }
  for (const MotionAt& motion : input.correction.flow.motions) {
    const auto left = [&](const Target& target) {
      return !target.point ||
             OutcomeOf(input, input.correction.points[*target.point]) == Outcome::kLeft;
    };
    const Motion& one = *motion.motion;
    counts.motions_left += left(one.end) || (one.via && left(*one.via)) ? 1 : 0;
  }
  counts.unread = static_cast<std::size_t>(
      std::ranges::count_if(input.program.remarks, [](const Remark& one) { return one.unread; }));
  return counts;
}

std::string ReportText(const ReportInput& input, bool every) {
  constexpr std::size_t kFirst = 40;
  std::string text;
  std::size_t shown = 0, corrected = 0;
  for (const PointCorrection& point : input.correction.points) {
    if (!point.reason.empty()) continue;
    if (corrected++ == 0) {
      text += fmt::format("{:<24} {:<14} {:>10} {:>9} {:>9}  {:<10} {}\n", "point", "line",
                          "correction", "turn", "95 %", "basis", "load, nearest limit");
    }
    if (!every && shown >= kFirst) continue;
    ++shown;
    const Point& source = input.program.points[point.point];
    text +=
        fmt::format("{:<24.24} {:<14} {:>7.3f} mm {:>5.3f} deg {:>6.2f} mm  {:<10} {}; {}\n",
                    NameOf(source), source.place.line, kMmPerMetre * point.translation_B.norm(),
                    point.rotation_rad * kDegPerRad, kMmPerMetre * point.radius_m,
                    model::Describe(point.basis), point.context.load_text, LimitText(input, point));
    for (const std::string& note : point.notes) text += "    " + text::Visible(note) + '\n';
  }
  if (corrected > shown) {
    text += fmt::format("    {} more; --all, --json and --report list them\n", corrected - shown);
  }
  for (const std::string& assumption : ToolAssumptionsOf(input)) text += assumption + '\n';
  for (const Refusal& refusal : input.refusals) {
    text += fmt::format("{}: stays as it is: {}; {}\n",
                        PlaceText(input.program, {refusal.file, refusal.line}), refusal.what,
                        refusal.remedy);
  }
  shown = 0;
  std::vector<Left> left = LeftOf(input);
  for (LeftMotion& motion : LeftMotionsOf(input)) {
    left.push_back({motion.place, NameOf(motion), std::move(motion.reason)});
  }
  for (const Left& one : left) {
    if (!every && shown++ >= kFirst) continue;
    text += fmt::format("{}: {} stays as it is: {}\n", PlaceText(input.program, one.place),
                        one.names, text::Visible(one.reason));
  }
  if (!every && left.size() > kFirst) {
    text +=
        fmt::format("    {} more; --all, --json and --report list them\n", left.size() - kFirst);
  }
  shown = 0;
  for (const Remark& remark : input.program.remarks) {
    if (!every && shown++ >= kFirst) continue;
    text +=
        fmt::format("{}: {}\n", PlaceText(input.program, remark.place), text::Visible(remark.text));
  }
  const ReportCounts counts = CountsOf(input);
  if (input.correction.flow.motions.empty()) text += "no motion was found in these files\n";
  text += SegmentsText(input);
  shown = 0;
  for (const std::string& line : UnrefinedOf(input)) {
    if (every || shown++ < kFirst) text += line + '\n';
  }
  text += fmt::format(
      "{} of {}: {} corrected ({} with other digits), {} left by choice, {} not used, {} left "
      "with a reason; {} not to a corrected point\n",
      input.brand.name(), CountText(input.program.files.size(), "file"),
      CountText(counts.corrected, "point"), counts.changed, counts.by_choice, counts.unused,
      counts.left, CountText(counts.motions_left, "motion"));
  if (counts.corrected > 0) {
    text += fmt::format(
        "largest error at a point, by the model: {:.3f} mm before, {:.4f} mm after; of rounding to "
        "the file's digits {:.4f} mm\n",
        kMmPerMetre * counts.largest_before_m, kMmPerMetre * counts.largest_after_m,
        kMmPerMetre * counts.largest_rounding_m);
  }
  return text;
}

nlohmann::json ReportJson(const ReportInput& input) {
  using Json = nlohmann::json;
  const auto mm = [](const Vec3& p) {
    return Json::array({kMmPerMetre * p.x(), kMmPerMetre * p.y(), kMmPerMetre * p.z()});
  };
  const auto turn_deg = [](const Pose& X) {
    const Vec3 turn = kDegPerRad * VectorFromRotation(X.R);
    return Json::array({turn.x(), turn.y(), turn.z()});
  };
  const auto file_of = [&](const Place& place) {
    return place.file < input.program.files.size()
               ? text::Visible(input.program.files[place.file].name)
               : std::string();
  };
  Json points = Json::array(), left = Json::array(), motions = Json::array(),
       segments = Json::array(), remarks = Json::array(), refusals = Json::array();
  for (const PointCorrection& point : input.correction.points) {
    const Point& source = input.program.points[point.point];
    Json entry = {{"name", text::Visible(source.name)},
                  {"file", file_of(source.place)},
                  {"line", source.place.line},
                  {"index", point.point}};
    if (!point.reason.empty()) {
      entry["reason"] = text::Visible(point.reason);
      entry["reason_file"] = file_of(point.reason_place);
      entry["reason_line"] = point.reason_place.line;
      entry["by_choice"] = OutcomeOf(input, point) != Outcome::kLeft;
      left.push_back(std::move(entry));
      continue;
    }
    entry["tool"] = text::Visible(point.context.tool_text);
    entry["base"] = text::Visible(point.context.base_text);
    entry["payload_kg"] = point.context.payload.mass_kg;
    entry["payload_cog_mm"] = mm(point.context.payload.cog_F);
    entry["taught_mm"] = mm(point.taught.p);
    entry["taught_rotation_vector_deg"] = turn_deg(point.taught);
    entry["corrected_mm"] = mm(point.corrected.p);
    entry["corrected_rotation_vector_deg"] = turn_deg(point.corrected);
    entry["correction_base_mm"] = mm(point.translation_B);
    entry["correction_mm"] = kMmPerMetre * point.translation_B.norm();
    entry["correction_deg"] = kDegPerRad * point.rotation_rad;
    entry["radius_95_mm"] = kMmPerMetre * point.radius_m;
    entry["radius_basis"] = model::Describe(point.basis);
    entry["extrapolated"] = point.extrapolated;
    entry["posture"] = InFileUnits(input.cell.robot, point.q_taught);
    entry["posture_corrected"] = InFileUnits(input.cell.robot, point.q_command);
    entry["singular_value"] = point.singular_value;
    if (point.limit.joint >= 0) {
      const model::JointType type =
          input.cell.robot.joints[static_cast<std::size_t>(point.limit.joint)].type;
      entry["limit_joint"] = point.limit.joint + 1;
      entry["limit_distance"] = point.limit.distance * model::PositionForm(type).from_SI;
      entry["limit_unit"] = model::PositionForm(type).unit;
    }
    entry["error_before_mm"] = kMmPerMetre * (point.before_B - point.target_B).norm();
    entry["error_after_mm"] = kMmPerMetre * (point.after_B - point.target_B).norm();
    entry["rounding_mm"] = kMmPerMetre * point.rounding_m;
    entry["rounding_deg"] = kDegPerRad * point.rounding_rad;
    entry["changed"] = !point.edits.empty();
    Json notes = Json::array();
    for (const std::string& note : point.notes) notes.push_back(text::Visible(note));
    entry["notes"] = notes;
    points.push_back(std::move(entry));
  }
  for (const LeftMotion& motion : LeftMotionsOf(input)) {
    motions.push_back({{"file", file_of(motion.place)},
                       {"line", motion.place.line},
                       {"target", motion.target},
                       {"reason", text::Visible(motion.reason)}});
  }
  for (const SegmentDeviation& segment : input.correction.segments) {
    const Place& place = input.correction.flow.motions[segment.motion].place;
    segments.push_back({{"file", file_of(place)},
                        {"line", place.line},
                        {"length_mm", kMmPerMetre * segment.length_m},
                        {"deviation_mm", kMmPerMetre * segment.largest_m},
                        {"deviation_at_ends_mm", kMmPerMetre * segment.ends_m},
                        {"inserted", segment.inserted},
                        {"note", segment.note}});
  }
  for (const Remark& remark : input.program.remarks) {
    remarks.push_back({{"file", file_of(remark.place)},
                       {"line", remark.place.line},
                       {"text", text::Visible(remark.text)},
                       {"unread", remark.unread}});
  }
  for (const Refusal& refusal : input.refusals) {
    refusals.push_back({{"file", file_of({refusal.file, 0})},
                        {"line", refusal.line},
                        {"what", text::Visible(refusal.what)},
                        {"remedy", text::Visible(refusal.remedy)}});
  }
  const ReportCounts counts = CountsOf(input);
  return {{"schema", 1},
          {"brand", input.brand.name()},
          {"cell", text::Visible(input.cell_file)},
          {"version", input.version},
          {"date", input.date},
          {"counts",
           {{"points", counts.points},
            {"corrected", counts.corrected},
            {"changed", counts.changed},
            {"left", counts.left},
            {"left_by_choice", counts.by_choice},
            {"unused", counts.unused},
            {"motions_left", counts.motions_left},
            {"unread", counts.unread}}},
          {"tool_assumptions", ToolAssumptionsOf(input)},
          {"largest_error_before_mm", kMmPerMetre * counts.largest_before_m},
          {"largest_error_after_mm", kMmPerMetre * counts.largest_after_m},
          {"largest_rounding_mm", kMmPerMetre * counts.largest_rounding_m},
          {"largest_between_points_mm", kMmPerMetre * LargestBetween(input.correction)},
          {"corrected", points},
          {"left", left},
          {"left_motions", motions},
          {"segments", segments},
          {"remarks", remarks},
          {"refusals", refusals}};
}

std::string ReportPage(const ReportInput& input) {
  using measure::Escape;
  std::string title = "Corrected program";
  if (!input.program.files.empty()) title += " " + text::Visible(input.program.files.front().name);
  std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>" +
      Escape(title) +
      "</title>\n<style>body{font:15px/1.5 sans-serif;color:#25313a;max-width:72em;"
      "margin:2em auto;padding:0 1em}table{border-collapse:collapse;margin:1em 0}"
      "th,td{padding:.2em .7em;border-bottom:1px solid #dde3e6;text-align:right;"
      "vertical-align:top}.text,th.text{text-align:left}svg{width:100%;height:auto}"
      "h2{margin-top:2em}</style>\n</head>\n<body>\n<h1>" +
      Escape(title) + "</h1>\n";
  page += "<p>" +
          Escape(fmt::format("{}; cell {}; Plumbline {}; {}", input.brand.name(),
                             text::Visible(input.cell_file), input.version, input.date)) +
          "</p>\n";
  const ReportCounts counts = CountsOf(input);
  page += fmt::format(
      "<p>{} corrected, {} left by choice, {} not used, {} left with a reason; {} not to a "
      "corrected point. Largest error at a point, by the model: {:.3f} mm before, {:.4f} mm "
      "after.</p>\n",
      CountText(counts.corrected, "point"), counts.by_choice, counts.unused, counts.left,
      CountText(counts.motions_left, "motion"), kMmPerMetre * counts.largest_before_m,
      kMmPerMetre * counts.largest_after_m);
  if (const std::string between = SegmentsText(input); !between.empty()) {
    page += "<p>" + Escape(between) + "</p>\n";
  }
  for (const std::string& line : UnrefinedOf(input)) page += "<p>" + Escape(line) + "</p>\n";
  for (const std::string& line : ToolAssumptionsOf(input)) page += "<p>" + Escape(line) + "</p>\n";
  page += PathPicture(input.correction);
  measure::HtmlTable table({"point", "line", "taught, mm", "corrected, mm", "turn, deg",
                            "95 % radius, mm", "basis", "load", "nearest limit",
                            "smallest singular "
                            "value"},
                           {0, 2, 3, 6, 7, 8});
  for (const PointCorrection& point : input.correction.points) {
    if (!point.reason.empty()) continue;
    const Point& source = input.program.points[point.point];
    const auto mm = [](const Vec3& p) {
      return fmt::format("{:.3f}, {:.3f}, {:.3f}", kMmPerMetre * p.x(), kMmPerMetre * p.y(),
                         kMmPerMetre * p.z());
    };
    table.AddRow({Escape(NameOf(source)), Escape(PlaceText(input.program, source.place)),
                  mm(point.taught.p), mm(point.corrected.p),
                  fmt::format("{:.4f}", kDegPerRad * point.rotation_rad),
                  fmt::format("{:.3f}", kMmPerMetre * point.radius_m), model::Describe(point.basis),
                  Escape(point.context.load_text), Escape(LimitText(input, point)),
                  fmt::format("{:.3f}", point.singular_value)});
    for (const std::string& note : point.notes) table.AddNote("", Escape(text::Visible(note)));
  }
  if (!table.empty()) page += "<h2>Corrected points</h2>\n" + table.Html();
  measure::HtmlTable stays({"line", "point", "reason"}, {0, 1, 2});
  for (const Left& one : LeftOf(input)) {
    stays.AddRow({Escape(PlaceText(input.program, one.place)), Escape(one.names),
                  Escape(text::Visible(one.reason))});
  }
  for (const LeftMotion& motion : LeftMotionsOf(input)) {
    stays.AddRow({Escape(PlaceText(input.program, motion.place)), Escape(NameOf(motion)),
                  Escape(text::Visible(motion.reason))});
  }
  for (const Remark& remark : input.program.remarks) {
    stays.AddRow(
        {Escape(PlaceText(input.program, remark.place)), "", Escape(text::Visible(remark.text))});
  }
  for (const Refusal& refusal : input.refusals) {
    stays.AddRow({Escape(PlaceText(input.program, {refusal.file, refusal.line})), "",
                  Escape(text::Visible(refusal.what + "; " + refusal.remedy))});
  }
  if (!stays.empty()) page += "<h2>Lines that stay as they are</h2>\n" + stays.Html();
  return page + "</body>\n</html>\n";
}

}  // namespace plumbline::programs
