#include "app/measure/diagnosis/output/model_writer.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "app/base/config/cell_reader.h"
#include "app/base/config/model_fingerprint.h"
#include "app/base/text/text.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::measure {
namespace {

/// Finds the end of one statement, skipping newlines inside strings and brackets.
class Scanner {
 public:
  Scanner(std::string_view text, std::size_t at) : text_(text), at_(at) {}

  /// Position after the newline that ends the statement.
  std::size_t End() {
    int depth = 0;
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '"' || c == '\'') {
        SkipString(c);
        continue;
      }
      if (c == '#') {
        at_ = std::min(text_.find('\n', at_), text_.size());
        continue;
      }
      if (c == '[' || c == '{') ++depth;
      if (c == ']' || c == '}') --depth;
      ++at_;
      if (c == '\n' && depth <= 0) break;
    }
    return at_;
  }

 private:
  void SkipString(char quote) {
    const std::string three(3, quote);
    const bool multi_line = text_.substr(at_, 3) == three;
    at_ += multi_line ? 3 : 1;
    while (at_ < text_.size()) {
      if (text_[at_] == '\\' && quote == '"') {
        at_ += 2;
        continue;
      }
      if (multi_line ? text_.substr(at_, 3) == three : text_[at_] == quote) break;
      ++at_;
    }
    at_ = std::min(at_ + (multi_line ? 3 : 1), text_.size());
    // Up to two quotes may directly precede the closing three.
    while (multi_line && at_ < text_.size() && text_[at_] == quote) ++at_;
  }

  std::string_view text_;
  std::size_t at_;
};

/// The first part of a dotted key at the start of text: `domain` of `domain.q_deg`, `"domain"`.
std::string FirstKey(std::string_view text) {
  const auto start = text.find_first_not_of(" \t[");
  if (start == std::string_view::npos) return "";
  text.remove_prefix(start);
  if (text.front() == '"' || text.front() == '\'') {
    return std::string(text.substr(1, text.find(text.front(), 1) - 1));
  }
  return std::string(text.substr(0, text.find_first_of(" \t.=]\r\n")));
}

}  // namespace

std::vector<TomlStatement> TomlStatements(std::string_view text) {
  std::vector<TomlStatement> statements;
  std::size_t at = text.starts_with("\xEF\xBB\xBF") ? 3 : 0;
  if (at > 0) statements.push_back({TomlStatement::Kind::kOther, "", text.substr(0, at)});
  while (at < text.size()) {
    const std::size_t end = Scanner(text, at).End();
    TomlStatement& statement = statements.emplace_back();
    statement.text = text.substr(at, end - at);
    at = end;
    const auto first = statement.text.find_first_not_of(" \t\r\n");
    if (first == std::string_view::npos || statement.text[first] == '#') continue;
    statement.kind = statement.text[first] == '[' ? TomlStatement::Kind::kHeader
                                                  : TomlStatement::Kind::kKeyValue;
    statement.first_key = FirstKey(statement.text);
  }
  return statements;
}

std::string WithoutTable(std::string_view text, std::string_view name) {
  using Kind = TomlStatement::Kind;
  std::string kept;
  std::string pending;  // trailing blank lines and comments of a removed table
  bool in_root = true, inside = false;
  for (const TomlStatement& statement : TomlStatements(text)) {
    if (statement.kind == Kind::kHeader) {
      in_root = false;
      inside = statement.first_key == name;
      if (!inside) kept += pending;
      pending.clear();
      if (inside) continue;
    }
    if (inside) {
      if (statement.kind == Kind::kOther) {
        pending += statement.text;
      } else {
        pending.clear();
      }
      continue;
    }
    if (in_root && statement.kind == Kind::kKeyValue && statement.first_key == name) continue;
    kept += statement.text;
  }
  return kept + pending;
}

namespace {

/// The shortest text that TOML reads back as the same floating-point number.
std::string NumberText(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".einf") == std::string::npos) text += ".0";
  return text;
}

std::string StringText(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      quoted += fmt::format("\\u{:04X}", static_cast<unsigned char>(c));
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

template <typename Values, typename ToText>
std::string ListText(const Values& values, ToText to_text) {
  std::string list;
  for (const auto& value : values) list += (list.empty() ? "" : ", ") + to_text(value);
  return "[" + list + "]";
}

std::string VectorText(const Vec3& v) {
  return ListText(std::vector<double>{v.x(), v.y(), v.z()}, NumberText);
}

std::string MatrixText(const Eigen::MatrixXd& matrix) {
  std::vector<std::string> rows;
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    const Eigen::VectorXd row = matrix.row(r);
    rows.push_back(ListText(std::vector<double>(row.begin(), row.end()), NumberText));
  }
  return ListText(rows, [](const std::string& row) { return row; });
}

std::string IntervalText(const model::Interval& interval, double from_SI = 1) {
  return ListText(std::vector<double>{interval.low * from_SI, interval.high * from_SI}, NumberText);
}

std::string ParameterText(const model::EffectParameter& parameter) {
  std::string text = "{ name = " + StringText(parameter.name) + ", value = ";
  if (!parameter.word.empty()) return text + StringText(parameter.word) + " }";
  text += NumberText(parameter.value);
  if (parameter.sd && std::isfinite(*parameter.sd)) text += ", sd = " + NumberText(*parameter.sd);
  return text + ", unit = " + StringText(parameter.unit) + " }";
}

std::string EffectText(const model::WrittenEffect& effect) {
  std::string text = "\n[[effect]]\nid = " + StringText(effect.id) + '\n';
  text += "scope = " + ListText(effect.scope, StringText) + '\n';
  text += "parameters = [\n";
  for (const model::EffectParameter& parameter : effect.parameters) {
    text += "  " + ParameterText(parameter) + ",\n";
  }
  text += "]\n";
  if (effect.covariance.size() > 0 && effect.covariance.allFinite()) {
    text += "covariance = " + MatrixText(effect.covariance) + '\n';
  }
  if (effect.seen_t_s) text += "seen_t_s = " + IntervalText(*effect.seen_t_s) + '\n';
  if (!effect.drivers.empty()) text += "drivers = " + ListText(effect.drivers, StringText) + '\n';
  if (effect.nodes.size() > 0) text += "nodes = " + MatrixText(effect.nodes) + '\n';
  if (effect.from_file.empty() && !effect.from_rows && effect.from_date.empty()) return text;
  std::string from = "file = " + StringText(effect.from_file);
  if (effect.from_rows) from += fmt::format(", rows = {}", *effect.from_rows);
  return text + "from = { " + from + ", date = " + StringText(effect.from_date) + " }\n";
}

std::string SessionText(const model::SessionFrames& session) {
  std::string text = "\n[[session]]\nid = " + StringText(session.id) + '\n';
  text += "base_xyz_mm = " + VectorText(1e3 * session.X_WB.p) + '\n';
  text +=
      "base_rpy_deg = " + VectorText(kDegPerRad * RollPitchYawFromRotation(session.X_WB.R)) + '\n';
  const bool one = session.tips.size() == 1 && !session.tips.front().tool;
  if (one) text += "tip_mm = " + VectorText(1e3 * session.tips.front().p_F) + '\n';
  if (session.X_WB_declared) {
    const Pose& X_WB = *session.X_WB_declared;
    text += "declared_base_xyz_mm = " + VectorText(1e3 * X_WB.p) + '\n';
    text += "declared_base_rpy_deg = " + VectorText(kDegPerRad * RollPitchYawFromRotation(X_WB.R)) +
            '\n';
  }
  if (one && session.tips.front().declared_F) {
    text += "declared_tip_mm = " + VectorText(1e3 * *session.tips.front().declared_F) + '\n';
  }
  for (const model::SessionTip& tip : session.tips) {
    if (!tip.tool) continue;
    text += fmt::format("\n[[session.tip]]\ntool = {}\n", *tip.tool);
    text += "xyz_mm = " + VectorText(1e3 * tip.p_F) + '\n';
    if (tip.declared_F) text += "declared_xyz_mm = " + VectorText(1e3 * *tip.declared_F) + '\n';
  }
  return text;
}

std::string PoseText(const model::JointVector& q, const std::vector<model::Joint>& joints) {
  std::vector<double> values;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const bool prismatic = joints[i].type == model::JointType::kPrismatic;
    values.push_back((prismatic ? 1e3 : kDegPerRad) * q[static_cast<int>(i)]);
  }
  return ListText(values, [](double value) { return fmt::format("{:.3f}", value); });
}

/// The ends of the intervals, and the growth if it is known.
std::string RangeText(const char* key, const model::MeasuredRange& measured, const char* growth_key,
                      double growth_from_SI) {
  std::vector<std::string> ends;
  for (const model::Interval& interval : measured.intervals) {
    ends.push_back(NumberText(interval.low));
    ends.push_back(NumberText(interval.high));
  }
  std::string text = fmt::format("{} = [{}]\n", key, fmt::join(ends, ", "));
  if (measured.growth)
    text += fmt::format("{} = {}\n", growth_key, NumberText(growth_from_SI * *measured.growth));
  return text;
}

std::string DomainText(const model::Domain& domain, const std::vector<model::Joint>& joints) {
  std::vector<std::string> pairs;
  for (std::size_t i = 0; i < domain.q.size(); ++i) {
    const bool prismatic = joints[i].type == model::JointType::kPrismatic;
    pairs.push_back(IntervalText(domain.q[i], prismatic ? 1e3 : kDegPerRad));
  }
  std::string text = "\n[domain]\nq_deg = ";
  text += ListText(pairs, [](const std::string& pair) { return pair; }) + '\n';
  if (!domain.torques.empty()) {
    text += "torques_Nm = [\n";
    for (const model::MeasuredTorque& torque : domain.torques) {
      const model::Interval& range = torque.range.intervals.front();
      text += fmt::format("  [{}, {}, {}", torque.joint + 1, NumberText(range.low),
                          NumberText(range.high));
      if (torque.range.growth) text += ", " + NumberText(1e3 * *torque.range.growth);
      text += "],\n";
    }
    text += "]\n";
  }
  if (!domain.tools.empty()) text += fmt::format("tools = [{}]\n", fmt::join(domain.tools, ", "));
  if (domain.payload_items) {
    text += fmt::format("payload_items = [{}]\n", fmt::join(*domain.payload_items, ", "));
  }
  if (domain.payload_kg)
    text += RangeText("payload_kg", *domain.payload_kg, "payload_growth_mm_per_kg", 1e3);
  if (domain.temp_C) text += RangeText("temp_C", *domain.temp_C, "temp_growth_mm_per_K", 1e3);
  if (domain.t_s) text += RangeText("t_s", *domain.t_s, "time_growth_mm_per_h", 1e3 * 3600);
  if (domain.largest_residual_m) {
    text += "largest_residual_mm = " + NumberText(1e3 * *domain.largest_residual_m) + '\n';
  }
  if (domain.residual_sigma_m) {
    text += "residual_sigma_mm = " + NumberText(1e3 * *domain.residual_sigma_m) + '\n';
  }
  if (domain.covariance_share < 1) {
    text += "covariance_share = " + NumberText(domain.covariance_share) + '\n';
  }
  if (domain.distant_sigma_m && !domain.poses.empty()) {
    text += "distant_sigma_mm = " + NumberText(1e3 * *domain.distant_sigma_m) + '\n';
    if (domain.range_growth_m)
      text += "range_growth_mm = " + NumberText(1e3 * *domain.range_growth_m) + '\n';
    if (domain.reach_rad > 0) text += "reach_rad = " + NumberText(domain.reach_rad) + '\n';
    if (domain.declared_sigma_m) {
      text += "declared_sigma_mm = " + NumberText(1e3 * *domain.declared_sigma_m) + '\n';
      if (domain.applied_share < 1)
        text += "applied_share = " + NumberText(domain.applied_share) + '\n';
    }
    text += "poses_deg = [\n";
    for (const model::JointVector& q : domain.poses) text += "  " + PoseText(q, joints) + ",\n";
    text += "]\n";
  }
  if (domain.time_zero_s) {
    text += "time_zero_utc = " + StringText(text::TextFromUtc(*domain.time_zero_s)) + '\n';
  }
  return text;
}

/// The fingerprint, appended as the last key of [domain]; the text before it must not change
/// afterwards.
std::string FingerprintText(const std::string& text) {
  config::FaultList ignored;  // reported when the finished text is read back
  const config::TomlDocument document(text, "", ignored);
  return "fingerprint = " + StringText(config::ModelFingerprint(document)) + '\n';
}

/// True if the effects are an inline array at the root, to which no [[effect]] can be appended.
bool HasInlineEffects(std::string_view text) {
  for (const TomlStatement& statement : TomlStatements(text)) {
    if (statement.kind == TomlStatement::Kind::kHeader) return false;
    if (statement.first_key == "effect") return true;
  }
  return false;
}

std::string WithLineEnds(const std::string& text, bool carriage_returns) {
  if (!carriage_returns) return text;
  std::string ended;
  for (const char c : text) ended += c == '\n' ? std::string("\r\n") : std::string(1, c);
  return ended;
}

}  // namespace

Result<std::string> CorrectedCellText(std::string_view original, const model::CellModel& cell,
                                      const Diagnosis& diagnosis, const DataOrigin& origin) {
  std::string text(original);
  std::string added = fmt::format("\n# Found by plumbline diagnose in {} ({} rows, {})\n",
                                  StringText(origin.file), origin.rows, origin.date);
  const bool withheld = !diagnosis.withheld.empty();
  const bool adds = !withheld && (!diagnosis.findings.empty() || !diagnosis.discrepancy.empty());
  if (withheld) added += "# No correction: " + diagnosis.withheld + '\n';
  if (adds && HasInlineEffects(text)) {
    text = WithoutTable(text, "effect");
    for (const model::WrittenEffect& effect : cell.effects) added += EffectText(effect);
  }
  const auto add = [&](const Finding& finding) {
    model::WrittenEffect effect = effects::WrittenFromActive(finding.effect, finding.covariance);
    effect.from_file = finding.origin.empty() ? origin.file : finding.origin;
    if (finding.origin.empty()) effect.from_rows = origin.rows;
    effect.from_date = origin.date;
    added += EffectText(effect);
  };
  if (adds) std::for_each(diagnosis.findings.begin(), diagnosis.findings.end(), add);
  if (!diagnosis.discrepancy.empty()) {
    added +=
        "\n# Discrepancy model: a shrunken fit of the remaining residual. It corrects within the "
        "measured range and explains nothing\n";
  }
  for (const Finding& finding : diagnosis.discrepancy) add(finding);
  if (!diagnosis.sessions.empty()) {
    text = WithoutTable(text, "session");
    for (const model::SessionFrames& session : diagnosis.sessions) added += SessionText(session);
  }
  const bool has_domain = !diagnosis.domain.q.empty();
  if (has_domain) {
    text = WithoutTable(text, "domain");
    added += DomainText(diagnosis.domain, cell.robot.joints);
  }
  if (!text.empty() && text.back() != '\n') text += '\n';
  const bool carriage_returns = original.find("\r\n") != std::string_view::npos;
  text += WithLineEnds(added, carriage_returns);
  if (has_domain) text += WithLineEnds(FingerprintText(text), carriage_returns);
  config::FaultList faults;
  if (!config::CellFromText(text, "corrected model", faults))
    return Error{config::FaultsText(faults)};
  return text;
}

}  // namespace plumbline::measure
