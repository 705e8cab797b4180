#include "app/measure/diagnosis/output/answer.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "app/base/text/json_text.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::measure {
namespace {

using Json = nlohmann::ordered_json;

Json Millimetres(double metres) {
  return text::NumberJson(metres * kMmPerMetre);
}

Json JsonOf(const model::EffectParameter& parameter) {
  if (!parameter.word.empty()) return {{"name", parameter.name}, {"value", parameter.word}};
  return {{"name", parameter.name},
          {"value", text::NumberJson(parameter.value)},
          {"sd", parameter.sd ? text::NumberJson(*parameter.sd) : Json(nullptr)},
          {"unit", parameter.unit}};
}

Json JsonOf(const Finding& finding) {
  const model::WrittenEffect written =
      effects::WrittenFromActive(finding.effect, finding.covariance);
  Json parameters = Json::array();
  for (const model::EffectParameter& parameter : written.parameters)
    parameters.push_back(JsonOf(parameter));
  Json json = {{"id", written.id},
               {"scope", written.scope},
               {"parameters", parameters},
               {"p_value", text::NumberJson(finding.p_value)},
               {"share_of_residual", text::NumberJson(finding.share_of_residual)}};
  const std::string line = LinearTrendText(finding.effect);
  if (!line.empty()) json["in_words"] = line;
  return json;
}

Json JsonOf(const KindError& error) {
  const auto held_out = [](const std::optional<double>& metres) {
    return metres ? Millimetres(*metres) : Json(nullptr);
  };
  return {{"before", Millimetres(error.before_m)},
          {"after", Millimetres(error.after_m)},
          {"before_held_out", held_out(error.before_held_out_m)},
          {"after_held_out", held_out(error.after_held_out_m)},
          {"noise_floor", Millimetres(error.noise_floor_m)},
          {"rows", error.rows}};
}

Json JsonOf(const ExplanationCheck& check) {
  return {{"name", check.name},
          {"effect", check.effect.empty() ? Json(nullptr) : Json(check.effect)},
          {"passed", check.passed},
          {"figure", text::NumberJson(check.figure)},
          {"limit", text::NumberJson(check.limit)},
          {"in_words", check.sentence}};
}

Json JsonOf(const effects::ActiveEffect& effect, const Eigen::MatrixXd& covariance) {
  const model::WrittenEffect written = effects::WrittenFromActive(effect, covariance);
  Json parameters = Json::array();
  for (const model::EffectParameter& parameter : written.parameters)
    parameters.push_back(JsonOf(parameter));
  return {{"id", written.id}, {"scope", written.scope}, {"parameters", parameters}};
}

Json JsonOf(const SiblingEvidence& siblings) {
  const auto error = [](double metres) { return metres > 0 ? Millimetres(metres) : Json(nullptr); };
  const auto text = [](const std::string& words) {
    return words.empty() ? Json(nullptr) : Json(words);
  };
  Json json = {{"from", text(siblings.source)},
               {"model", text(siblings.model)},
               {"date", text(siblings.date)},
               {"arms", siblings.arms},
               {"left_out", siblings.left_out},
               {"used", siblings.used},
               {"in_words", siblings.reason},
               {"effects", Json::array()},
               {"applied", Json::array()},
               {"error_mm",
                {{"declared", error(siblings.declared_m)},
                 {"predicted_by_siblings", error(siblings.predicted_m)},
                 {"held_out_without", error(siblings.held_out_without_m)},
                 {"held_out_with", error(siblings.held_out_with_m)}}}};
  for (const Finding& one : siblings.common) {
    json["effects"].push_back(JsonOf(one.effect, one.covariance));
  }
  for (const effects::ActiveEffect& one : siblings.applied) {
    json["applied"].push_back(JsonOf(one, one.covariance));
  }
  return json;
}

}  // namespace

const char* Describe(Verdict verdict) {
  switch (verdict) {
    case Verdict::kNoEffect:
      return "no_effect";
    case Verdict::kExplained:
      return "explained";
    case Verdict::kAmbiguous:
      return "ambiguous";
    case Verdict::kUnknown:
      break;
  }
  return "unknown";
}

std::string AnswerJson(const Diagnosis& diagnosis, const std::string& next_poses_file) {
  Json answer = {{"schema", 1}, {"verdict", Describe(diagnosis.verdict)}};
  answer["effects"] = Json::array();
  for (const Finding& finding : diagnosis.findings) answer["effects"].push_back(JsonOf(finding));
  answer["rivals"] = Json::array();
  for (const Rival& rival : diagnosis.rivals) {
    Json& json =
        answer["rivals"].emplace_back(Json{{"instead_of", rival.instead_of},
                                           {"id", rival.id},
                                           {"signal_left", text::NumberJson(rival.signal_left)}});
    if (!rival.scope.empty()) json["scope"] = rival.scope;
    if (!rival.word.empty()) json["word"] = rival.word;
    if (!rival.only.empty()) json["only"] = rival.only;
    if (!rival.along.empty()) json["along"] = rival.along;
    if (rival.cycles) json["cycles_per_turn"] = *rival.cycles;
  }
  answer["drivers"] = diagnosis.drivers;
  answer["next_poses"] = next_poses_file.empty() ? Json(nullptr) : Json(next_poses_file);
  answer["minimum_detectable_mm"] = Json::object();
  for (const auto& [id, size_m] : diagnosis.minimum_detectable_m) {
    answer["minimum_detectable_mm"][id] = Millimetres(size_m);
  }
  const auto held_out = [&](double metres) {
    return diagnosis.held_out_by.empty() ? Json(nullptr) : Millimetres(metres);
  };
  answer["rms_mm"] = {{"before", Millimetres(diagnosis.rms_before_m)},
                      {"after", Millimetres(diagnosis.rms_after_m)},
                      {"before_held_out", held_out(diagnosis.held_out.before_m)},
                      {"after_held_out", held_out(diagnosis.held_out.after_m)},
                      {"noise_floor", Millimetres(diagnosis.noise_floor_m)}};
  answer["rms_by_kind_mm"] = Json::object();
  for (const KindError& error : diagnosis.rms_by_kind) {
    answer["rms_by_kind_mm"][error.kind] = JsonOf(error);
  }
  answer["not_observable"] = Json::array();
  for (const NotObservable& hidden : diagnosis.not_observable) {
    answer["not_observable"].push_back({{"id", hidden.id},
                                        {"scope", hidden.scope},
                                        {"parameters", hidden.parameters},
                                        {"reason", hidden.reason}});
  }
  answer["outlier_rows"] = diagnosis.outlier_rows;
  answer["implausible"] = Json::array();
  for (const Finding& finding : diagnosis.findings) {
    if (finding.implausible.empty()) continue;
    answer["implausible"].push_back(std::string(finding.effect.term.effect->traits().id) + ": " +
                                    finding.implausible);
  }
  answer["discrepancy_model"] = nullptr;
  if (!diagnosis.discrepancy.empty()) {
    answer["discrepancy_model"] = {
        {"parameters", text::NumberJson(diagnosis.discrepancy_parameters)},
        {"share_of_correction", text::NumberJson(diagnosis.discrepancy_share)}};
  }
  answer["checks"] = Json::array();
  for (const ExplanationCheck& check : diagnosis.checks) answer["checks"].push_back(JsonOf(check));
  answer["set_aside"] = Json::array();
  for (const Contradiction& one : diagnosis.references.set_aside) {
    answer["set_aside"].push_back(one.sentence);
  }
  answer["doubts"] = Json::array();
  for (const Doubt& doubt : diagnosis.doubts) {
    answer["doubts"].push_back(
        {{"id", doubt.id}, {"scope", doubt.scope}, {"reason", doubt.reason}});
  }
  answer["held_out"] = Json::array();
  for (const HeldOutError& error : diagnosis.held_out_by_all) {
    answer["held_out"].push_back({{"by", error.by},
                                  {"before_mm", Millimetres(error.before_m)},
                                  {"after_mm", Millimetres(error.after_m)},
                                  {"after_low_mm", Millimetres(error.after_low_m)},
                                  {"after_high_mm", Millimetres(error.after_high_m)}});
  }
  if (diagnosis.siblings) answer["siblings"] = JsonOf(*diagnosis.siblings);
  answer["withheld"] = diagnosis.withheld.empty() ? Json(nullptr) : Json(diagnosis.withheld);
  answer["notes"] = diagnosis.notes;
  // A column name may contain bytes that are not UTF-8; replace them instead of throwing.
  return text::JsonText(answer, 1) + '\n';
}

namespace {

/// Optional columns of next_poses.csv; each is written only if some pose needs it.
struct NextPoseColumns {
  bool payload = false, tool = false, item = false, qd = false, qdd = false, wait = false,
       measure = false;
};

NextPoseColumns ColumnsOf(const std::vector<NextPose>& poses, const model::CellModel& cell) {
  NextPoseColumns columns;
  columns.payload = cell.payload_cog_F.has_value();
  for (const NextPose& pose : poses) {
    columns.tool = columns.tool || (cell.tool.number && pose.tool_number);
    columns.item = columns.item || (!cell.payload_items.empty() && pose.payload_item);
    columns.qd = columns.qd || pose.qd.size() > 0;
    columns.qdd = columns.qdd || pose.qdd.size() > 0;
    columns.wait = columns.wait || pose.wait_s > 0;
    columns.measure = columns.measure || pose.via_q.size() > 0;
  }
  return columns;
}

/// Joint values in file units; zeros if `values` is empty.
void AddJointValues(const std::vector<model::Joint>& joints, const model::JointVector& values,
                    std::vector<std::string>& cells) {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const double to_file =
        joints[i].type == model::JointType::kPrismatic ? kMmPerMetre : kDegPerRad;
    const double value = values.size() > 0 ? values[static_cast<Eigen::Index>(i)] : 0;
    cells.push_back(fmt::format("{:.5f}", value * to_file));
  }
}

std::string Header(const std::vector<model::Joint>& joints, const NextPoseColumns& columns) {
  std::vector<std::string> names;
  const auto add = [&](const char* prefix, const char* suffix) {
    for (std::size_t i = 0; i < joints.size(); ++i) {
      const char* unit = joints[i].type == model::JointType::kPrismatic ? "mm" : "deg";
      names.push_back(fmt::format("{}{}_{}{}", prefix, i + 1, unit, suffix));
    }
  };
  add("q", "");
  if (columns.payload) names.emplace_back("payload_kg");
  if (columns.tool) names.emplace_back("tool");
  if (columns.item) names.emplace_back("payload_item");
  if (columns.qd) add("qd", "_s");
  if (columns.qdd) add("qdd", "_s2");
  if (columns.wait) names.emplace_back("wait_min");
  if (columns.measure) names.emplace_back("measure");
  return fmt::format("{}\n", fmt::join(names, ","));
}

/// One row of the file. A wait is written in the first of the two rows of a pose with a via pose.
std::string RowAt(const NextPose& pose, bool via, const std::vector<model::Joint>& joints,
                  const NextPoseColumns& columns) {
  std::vector<std::string> cells;
  AddJointValues(joints, via ? pose.via_q : pose.q, cells);
  if (columns.payload) cells.push_back(fmt::format("{:.5f}", pose.payload_kg));
  if (columns.tool) cells.push_back(fmt::format("{}", pose.tool_number.value_or(0)));
  if (columns.item) cells.push_back(fmt::format("{}", pose.payload_item.value_or(0)));
  if (columns.qd) AddJointValues(joints, via ? model::JointVector() : pose.qd, cells);
  if (columns.qdd) AddJointValues(joints, via ? model::JointVector() : pose.qdd, cells);
  if (columns.wait) {
    const bool waits = via || pose.via_q.size() == 0;  // in the first of two rows
    cells.push_back(fmt::format("{:.6g}", waits ? pose.wait_s / 60 : 0.0));
  }
  if (columns.measure) cells.emplace_back(via ? "0" : "1");
  return fmt::format("{}\n", fmt::join(cells, ","));
}

}  // namespace

std::string NextPosesCsv(const Diagnosis& diagnosis, const model::CellModel& cell) {
  const std::vector<model::Joint>& joints = cell.robot.joints;
  const NextPoseColumns columns = ColumnsOf(diagnosis.next_poses, cell);
  std::string text = Header(joints, columns);
  for (const NextPose& pose : diagnosis.next_poses) {
    if (pose.via_q.size() > 0) text += RowAt(pose, true, joints, columns);
    text += RowAt(pose, false, joints, columns);
  }
  return text;
}

}  // namespace plumbline::measure
