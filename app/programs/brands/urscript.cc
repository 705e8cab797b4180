#include "app/programs/brands/urscript.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "app/programs/brands/orientation_branches.h"
#include "app/programs/brands/source_cursor.h"
#include "app/programs/brands/urscript_routines.h"
#include "app/programs/brands/urscript_syntax.h"

namespace plumbline::programs {

namespace urscript {
namespace {

bool EndsWith(std::string_view name, std::string_view suffix) {
  return name.size() >= suffix.size() && SameWord(name.substr(name.size() - suffix.size()), suffix);
}

bool IsPolyScope(const SourceFile& file) {
  return EndsWith(file.name, ".urp") &&
         (file.bytes.starts_with("\x1f\x8b") || file.bytes.starts_with("<URProgram"));
}

constexpr std::string_view kMarkSign = "plumbline";

/// The mark in the comments before the first statement.
std::string MarkIn(std::string_view bytes) {
  const LineIndex lines(bytes);
  for (int line = 1; line <= lines.count(); ++line) {
    std::string_view text = lines.Text(line);
    if (line == 1 && text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    text = TrimBlanks(text);
    if (text.empty()) continue;
    if (text.front() != '#') return "";
    text = TrimBlanks(text.substr(1));
    if (StartsWithWord(text, kMarkSign)) return std::string(text);
  }
  return "";
}

/// The line of the first node that PolyScope writes into the scripts that it generates; 0: none.
int NodeLine(std::string_view bytes) {
  const LineIndex lines(bytes);
  for (int line = 1; line <= lines.count(); ++line) {
    if (TrimBlanks(lines.Text(line)).starts_with("$ ")) return line;
  }
  return 0;
}

class UrScript final : public Brand {
 public:
  std::string_view name() const override { return "Universal Robots URScript"; }

  const Conventions& conventions() const override {
    static const Conventions kConventions = [] {
      Conventions made;
      made.m_per_unit = 1;
      made.orientation_numbers = 3;
      made.length = {.least_significant = 6, .least_decimals = 6};
      made.angle = {.least_significant = 6, .least_decimals = 6};
      made.rotation = RotationFromVectorNumbers;
      made.numbers = VectorNear;
      return made;
    }();
    return kConventions;
  }

  bool Recognises(const SourceFile& file) const override {
    if (IsPolyScope(file)) return true;
    if (!EndsWith(file.name, ".script") && !EndsWith(file.name, ".urscript")) return false;
    for (const char* const word : {"def ", "movej(", "movel(", "movep(", "movec(", "set_tcp("}) {
      if (file.bytes.find(word) != std::string::npos) return true;
    }
    return false;
  }

  Reading Read(std::vector<SourceFile> files) const override;

  bool Agrees(const Configuration&, const kinematics::Chain&, const model::JointVector&,
              MotionKind) const override {
    return true;  // poses state no posture
  }
  std::vector<std::string> ConfigurationOf(const Configuration&, const kinematics::Chain&,
                                           const model::JointVector&) const override {
    return {};
  }

  std::optional<Insertion> Mark(const SourceFile& file, std::string_view mark) const override {
    if (IsPolyScope(file)) return std::nullopt;
    const LineIndex lines(file.bytes);
    return Insertion{file.bytes.starts_with("\xEF\xBB\xBF") ? std::size_t{3} : 0,
                     fmt::format("# {}{}", mark, lines.UsualLineEnd())};
  }

  std::optional<std::string> InsertedMotion(const Program& program, const Motion& motion,
                                            std::span<const double> numbers,
                                            double part_m) const override;
};

Reading UrScript::Read(std::vector<SourceFile> files) const {
  Reading reading;
  Program& program = reading.program;
  program.files = std::move(files);
  program.marks.resize(program.files.size());
  program.bases[kRobotBase] = {};

  std::vector<Syntax> syntaxes(program.files.size());
  Callable callable;
  std::set<std::string> several;
  for (std::size_t i = 0; i < program.files.size(); ++i) {
    const SourceFile& file = program.files[i];
    if (IsPolyScope(file)) {
      reading.refusals.push_back(
          {i, 0,
           "a PolyScope program with its waypoints as joint angles. The robot runs this file, not "
           "the .script beside it, and it still has the old points",
           "call the corrected .script from it in a Script node (File), or teach its waypoints "
           "anew"});
      continue;
    }
    program.marks[i] = MarkIn(file.bytes);
    if (const int line = NodeLine(file.bytes)) {
      program.remarks.push_back({{i, line},
                                 "PolyScope wrote this script beside a .urp. The robot runs the "
                                 ".urp, which still has the old points: call the corrected script "
                                 "from it in a Script node (File)"});
    }
    syntaxes[i] = Parse(file.bytes, i);
    for (std::size_t k = 1; k < syntaxes[i].routines.size(); ++k) {
      const RoutineHead& head = syntaxes[i].routines[k];
      if (head.outer == 0 && !callable.try_emplace(std::string(head.name), i).second) {
        several.emplace(head.name);
      }
    }
  }
  for (const std::string& name : several) callable.erase(name);
  for (std::size_t i = 0; i < program.files.size(); ++i) {
    if (syntaxes[i].routines.empty()) continue;
    Called called;
    for (std::size_t k = 0; k < program.files.size(); ++k) {
      if (k == i) continue;
      for (const Expr& expr : syntaxes[k].exprs) {
        if (expr.kind == ExprKind::kCall) called.emplace(expr.name);
      }
    }
    AddRoutines(syntaxes[i], i, callable, called,
                program.files.size() > 1 ? program.files[i].name + ": " : "", program);
    program.remarks.insert(program.remarks.end(), syntaxes[i].remarks.begin(),
                           syntaxes[i].remarks.end());
  }
  return reading;
}

/// The blend radius of a movel: its argument r, or the fifth one.
const Expr* BlendOf(const Syntax& syntax, const Expr& call) {
  constexpr std::size_t kPlace = 4;
  for (std::size_t k = 1; k < call.parts.size(); ++k) {
    const std::string_view name = call.part_names[k];
    if (name == "r" || (name.empty() && k == kPlace)) return &syntax.exprs[call.parts[k]];
  }
  return nullptr;
}

/// The statement with the target replaced by a pose, and the blend radius limited, so that the
/// blends of two parts do not meet. Circles are not divided: their parts need auxiliary points of
/// their own.
std::optional<std::string> UrScript::InsertedMotion(const Program& program, const Motion& motion,
                                                    std::span<const double> numbers,
                                                    double part_m) const {
  if (motion.kind != MotionKind::kLinear || !motion.end.point || numbers.size() != 6 ||
      motion.end.offset.in != Offset::In::kNone) {
    return std::nullopt;
  }
  const std::string_view bytes = program.files[motion.statement.file].bytes;
  const std::string_view text =
      bytes.substr(motion.statement.begin, motion.statement.end - motion.statement.begin);
  const Syntax syntax = Parse(text, 0);
  if (syntax.statements.size() != 1 || syntax.statements[0].expr == kNone) {
    return std::nullopt;
  }
  const Expr& call = syntax.exprs[syntax.statements[0].expr];
  if (call.kind != ExprKind::kCall || call.parts.empty()) return std::nullopt;
  const Expr* place = &syntax.exprs[call.parts[0]];
  const bool feature = motion.base && motion.base->key != kRobotBase;
  if (feature) {
    if (place->name != "pose_trans" || place->parts.size() != 2) return std::nullopt;
    place = &syntax.exprs[place->parts[1]];
  }
  if (place->kind != ExprKind::kPose && place->kind != ExprKind::kName &&
      place->kind != ExprKind::kIndex) {
    return std::nullopt;
  }
  const std::size_t line_end = bytes.find_last_of("\r\n", motion.statement.begin);
  const std::size_t line = line_end == std::string_view::npos ? 0 : line_end + 1;
  const std::string_view before = bytes.substr(line, motion.statement.begin - line);
  if (!TrimBlanks(before).empty()) return std::nullopt;  // not alone on its line
  const std::size_t next = bytes.find_first_of("\r\n", motion.statement.end);
  const bool both = next != std::string_view::npos && bytes.substr(next, 2) == "\r\n";
  std::string pose;
  for (const double number : numbers)
    pose += fmt::format("{}{:.9f}", pose.empty() ? "" : ", ", number);
  std::string rest(text.substr(place->end));
  constexpr double kShare = 0.4;  // of a part, so that two blends do not meet
  const double most_m = kShare * part_m;
  const Expr* const blend = BlendOf(syntax, call);
  if (blend != nullptr && (blend->kind != ExprKind::kNumber || blend->number > most_m)) {
    rest.replace(blend->begin - place->end, blend->end - blend->begin,
                 fmt::format("{:.5f}", most_m));
  }
  return fmt::format("{}p[{}]{}{}{}", text.substr(0, place->begin), pose, rest,
                     both ? "\r\n" : "\n", before);
}

}  // namespace
}  // namespace urscript

const Brand& UniversalRobots() {
  static const urscript::UrScript kBrand;
  return kBrand;
}

}  // namespace plumbline::programs
