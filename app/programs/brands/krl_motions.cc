// Motion statements of KRL: targets, chains of poses, WITH.
#include <algorithm>
#include <array>

#include "app/programs/brands/krl_routine_reader.h"

namespace plumbline::programs::krl {

std::optional<MotionStatement> MotionIn(const Statement& statement) {
  struct Form {
    std::string_view word;
    MotionKind kind;
  };
  constexpr std::array<Form, 7> kForms = {{{"ptp", MotionKind::kJoint},
                                           {"lin", MotionKind::kLinear},
                                           {"circ", MotionKind::kCircular},
                                           {"sptp", MotionKind::kJoint},
                                           {"slin", MotionKind::kLinear},
                                           {"scirc", MotionKind::kCircular},
                                           {"spl", MotionKind::kSpline}}};
  if (statement.size() < 2 || !statement.HasAnyWord(0)) return std::nullopt;
  std::string word = Lowered(statement.tokens[0].text);
  MotionStatement motion;
  if (word.ends_with("_rel")) {
    motion.relative = true;
    word.resize(word.size() - 4);
  }
  const auto form = std::ranges::find(kForms, std::string_view(word), &Form::word);
  // `LIN=1` and `SPL[2]=...` are variables.
  if (form == kForms.end() || statement.Has(1, '=') || statement.Has(1, '[') ||
      statement.Has(1, '.')) {
    return std::nullopt;
  }
  motion.kind = form->kind;
  std::size_t end = statement.size();
  for (std::size_t at = 1; at < statement.size();) {
    const Token& token = statement.tokens[at];
    const bool approximates = token.IsWord("C_PTP") || token.IsWord("C_DIS") ||
                              token.IsWord("C_VEL") || token.IsWord("C_ORI") ||
                              token.IsWord("C_SPL");
    const bool angle = token.IsWord("CA") && at > 1 && statement.Has(at - 1, ',');
    const bool with = token.IsWord("WITH");
    if (at > 1 && (approximates || angle || with || token.Is('#'))) end = std::min(end, at);
    motion.passes_by = motion.passes_by || (at > 1 && approximates && !motion.with);
    motion.has_angle = motion.has_angle || (at > 1 && angle);
    if (with && !motion.with) motion.with = at;
    const bool opens = token.Is('{') || token.Is('[') || token.Is('(');
    at = opens ? statement.Behind(at, statement.size()) : at + 1;
  }
  motion.behind_targets = end;
  for (std::size_t at = 1; at < end;) {
    const std::size_t next = statement.Find(',', at, end);
    if (next > at) motion.targets.emplace_back(at, next);
    at = next + 1;
  }
  return motion;
}

std::vector<Target> RoutineReader::ChainTargets(const Statement& statement, std::size_t begin,
                                                std::size_t end) {
  // F:P and P:F are products of poses; the first operand that is a point is the one that moves.
  struct Operand {
    std::size_t begin, end;
    std::vector<std::size_t> points;  // more than one if an index is not known
    bool frame = false;
  };
  std::vector<Operand> operands;
  std::optional<std::size_t> chosen;
  const auto rank = [&](const Operand& operand) {
    return operand.points.empty() ? 2 : operand.frame ? 1 : 0;
  };
  for (std::size_t at = begin; at < end;) {
    Operand operand{at, statement.Find(':', at, end), {}, false};
    std::size_t behind = at;
    if (statement.HasAnyWord(at) && !statement.Has(at + 1, '(')) {
      const Reference reference = names_.TakeReference(statement, module_, routine_, behind);
      const auto values = names_.ValuesAt(reference);
      if (behind == operand.end && reference.component.empty() && !values.empty()) {
        for (const Value* const value : values) {
          if (value->point) operand.points.push_back(*value->point);
        }
        operand.frame = names_.variable(*reference.variable).type == "frame";
      }
    }
    operands.push_back(operand);
    at = operand.end + 1;
    if (rank(operand) < 2 && (!chosen || rank(operand) < rank(operands[*chosen]))) {
      chosen = operands.size() - 1;
    }
  }
  Target target;
  target.computed = statement.Text(begin, end, names_.Bytes(statement.file));
  if (!chosen) {
    Use(statement, begin, end, "it is one of several poses that make a target");
    return {target};
  }
  const std::vector<std::size_t>& points = operands[*chosen].points;
  target.computed.clear();
  Pose before, after;
  for (std::size_t i = 0; i < operands.size(); ++i) {
    const Operand& operand = operands[i];
    if (i == *chosen) continue;
    std::string why;
    const auto X =
        settings_.Constant(statement, module_, routine_, operand.begin, operand.end, why);
    if (!X) target.offset.unknown = why;
    if (X && i < *chosen) before = before * *X;
    if (X && i > *chosen) after = after * *X;
    Use(statement, operand.begin, operand.end,
        fmt::format("it shifts {}", program_.points[points.front()].name));
  }
  const auto identity = [](const Pose& X) {
    return X.p.norm() < 1e-12 && (X.R - Mat3::Identity()).norm() < 1e-12;
  };
  const bool has_before = !identity(before), has_after = !identity(after);
  if (!target.offset.unknown.empty()) {
    target.offset.in = Offset::In::kTool;
  } else if (has_before && has_after) {
    target.offset = {Offset::In::kTool, {}, "the point is shifted in the base and in the tool"};
  } else if (has_before) {
    target.offset = {Offset::In::kBase, before, ""};
  } else if (has_after) {
    target.offset = {Offset::In::kTool, after, ""};
  }
  std::vector<Target> targets(points.size(), target);
  for (std::size_t i = 0; i < points.size(); ++i) targets[i].point = points[i];
  return targets;
}

std::vector<Target> RoutineReader::TargetsOf(const Statement& statement, std::size_t begin,
                                             std::size_t end) {
  const std::string_view bytes = names_.Bytes(statement.file);
  Target computed;
  computed.computed = statement.Text(begin, end, bytes);
  std::size_t at = begin;
  if (statement.Find(':', begin, end) < end) return ChainTargets(statement, begin, end);
  if (statement.Has(begin, '{')) {
    const auto aggregate = TakeAggregate(statement, bytes, at);
    if (!aggregate || at != end) return {computed};
    const bool joints =
        IsJointType(aggregate->type) ||
        std::ranges::any_of(aggregate->members, [](const Aggregate::Member& member) {
          return member.name.size() == 2 && member.name[0] == 'a' && IsDigit(member.name[1]);
        });
    Target target;
    target.point = names_.AddPoint(*aggregate, joints, "", statement.place());
    return {target};
  }
  if (!statement.HasAnyWord(begin) || statement.Has(begin + 1, '(')) {
    Use(statement, begin, end, "a target is computed from it");
    return {computed};
  }
  const Reference reference = names_.TakeReference(statement, module_, routine_, at);
  if (at != end || !reference.component.empty()) {
    Use(statement, begin, end, "a target is computed from it");
    return {computed};
  }
  std::vector<Target> targets;
  for (const Value* const value : names_.ValuesAt(reference)) {
    if (!value->point) continue;
    Target target;
    target.point = value->point;
    targets.push_back(std::move(target));
  }
  bool other = targets.empty();
  if (reference.variable && !other) {
    const Write* const write = names_.WriteTo(*reference.variable, reference.path);
    other = write != nullptr && !write->literal;
    // It may hold another value than the one that is written.
    if (other && reference.path.find("[*]") == std::string::npos) targets.clear();
  }
  if (other) targets.push_back(computed);
  if (!reference.variable && !reference.name.starts_with('$')) {
    targets.front().missing = "no file declares it; give the .dat that does";
  }
  return targets;
}

void RoutineReader::ReadWith(const Statement& statement, std::size_t begin, Motion& motion) {
  const std::string_view bytes = names_.Bytes(statement.file);
  for (std::size_t at = begin; at < statement.size();) {
    const std::size_t next = statement.Find(',', at, statement.size());
    const std::size_t equals = statement.Find('=', at, next);
    if (equals >= next || !statement.HasAnyWord(at)) {
      at = next + 1;
      continue;
    }
    const std::string name = Lowered(statement.tokens[at].text);
    const bool tool = name == "$tool", base = name == "$base", load = name == "$load";
    const std::size_t value = equals + 1;
    if (const auto frames = settings_.FunctionFrames(statement, module_, routine_, value)) {
      if (tool) motion.tool = frames->tool;
      if (base) motion.base = frames->base;
      if (load) motion.load = frames->load;
      if (frames->stationary && !frames->stationary->empty()) motion.special = *frames->stationary;
    } else if (tool || base) {
      Use(statement, value, next, fmt::format("it is a frame: {} is set to it", name), false);
      (tool ? motion.tool : motion.base) =
          settings_.Frame(statement, module_, routine_, value, next, base);
    } else if (load) {
      motion.load = settings_.LoadIn(statement, module_, routine_, value, next);
    } else if (name == "$ipo_mode" && !SameWord(statement.Text(value, next, bytes), "#BASE")) {
      motion.special = "external TCP: the tool may be stationary";
    } else {
      Use(statement, value, next, "it is used in an expression", false);
    }
    at = next + 1;
  }
}

void RoutineReader::EmitMotion(const Statement& statement, Motion motion,
                               const std::vector<Target>& vias, const std::vector<Target>& ends) {
  // A motion to an element that is not known goes to any of them.
  const Place place = statement.place();
  const std::size_t count = std::max<std::size_t>(1, vias.size()) * ends.size();
  if (count > 1) {
    if (alternatives_left_ < count) alternatives_left_ = 0;
    if (alternatives_left_ == 0) return;
    alternatives_left_ -= count;
  }
  const std::string behind = count > 1 ? NewLabel() : "";
  for (std::size_t i = 0; i < count; ++i) {
    const std::string next = i + 1 < count ? NewLabel() : "";
    if (!next.empty()) Jump(StepKind::kBranch, next, place);
    motion.end = ends[i % ends.size()];
    if (!vias.empty()) motion.via = vias[i / ends.size()];
    Emit(StepKind::kMotion, place).motion = motion;
    if (!next.empty()) {
      Jump(StepKind::kJump, behind, place);
      Label(next, place);
    }
  }
  if (count > 1) Label(behind, place);
}

void RoutineReader::ReadMotion(const Statement& statement, const MotionStatement& form) {
  Motion motion;
  if (in_spline_ && spline_) motion = *spline_;
  motion.kind = form.kind;
  motion.passes_by = form.passes_by;
  motion.statement = {statement.file, statement.tokens.front().begin, statement.tokens.back().end};
  if (form.with) ReadWith(statement, *form.with + 1, motion);
  const bool circle = form.kind == MotionKind::kCircular;
  if (form.targets.size() != (circle ? 2 : 1)) {
    program_.remarks.push_back({statement.place(), "a motion that is not understood", true});
    Use(statement, 1, statement.size(), "the motion is not understood");
    Emit(StepKind::kPostureLost, statement.place());
    return;
  }
  if (form.relative) {
    motion.special = "relative motion";
    program_.remarks.push_back({statement.place(), "a relative motion: it stays as it is"});
    for (const auto& [begin, end] : form.targets) {
      if (!statement.Has(begin, '{')) {
        Use(statement, begin, end, "it is the distance of a relative motion");
      }
    }
    const auto [begin, end] = form.targets.back();
    motion.end.computed = statement.Text(begin, end, names_.Bytes(statement.file));
    if (circle) motion.via = motion.end;
    Emit(StepKind::kMotion, statement.place()).motion = std::move(motion);
    return;
  }
  if (form.has_angle) motion.special = "the circle does not end at its end point (CA)";
  if (!active_.empty()) {
    motion.special = fmt::format("search motion: interrupt {} may end it early", *active_.begin());
  }
  std::vector<Target> vias;
  if (circle) vias = TargetsOf(statement, form.targets[0].first, form.targets[0].second);
  const auto [begin, end] = form.targets.back();
  EmitMotion(statement, std::move(motion), vias, TargetsOf(statement, begin, end));
}

}  // namespace plumbline::programs::krl
