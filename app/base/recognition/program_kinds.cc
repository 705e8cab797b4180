// Programs of robot controllers; targets written in them are counted.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "app/base/recognition/kinds.h"
#include "app/base/text/delimited_text.h"

namespace plumbline::recognition {
namespace {

bool IsText(const Outline& file) {
  return file.syntax() != Syntax::kBinary && file.syntax() != Syntax::kXml &&
         file.syntax() != Syntax::kEmpty;
}

const Line* LineWith(const Outline& file, std::string_view start) {
  return IsText(file) ? file.FindLine(start) : nullptr;
}

/// A line with one of these parts anywhere.
const Line* LineHolding(const Outline& file, std::initializer_list<std::string_view> parts) {
  if (!IsText(file)) return nullptr;
  for (const Line& line : file.head()) {
    for (const std::string_view part : parts) {
      if (line.text.find(part) != std::string_view::npos) return &line;
    }
  }
  return nullptr;
}

/// Something in brackets, as its end is met.
struct Literal {
  char open = '[';
  std::string_view inside;
  std::string_view before;          ///< in the same line
  std::string_view call;            ///< name of the innermost call around it; empty: none
  bool nested = false;              ///< in another of the same bracket
  std::vector<std::size_t> counts;  ///< of its elements, or of those of each list in it
};

/// What a language writes for a target.
struct TargetForms {
  char comment;  ///< up to the end of the line
  bool (*cartesian)(const Literal&);
  bool (*joints)(const Literal&);
};

bool SetsNoTarget(std::string_view before) {
  return before.starts_with("$") || before.find("FRAME") != std::string_view::npos ||
         before.find("_DATA") != std::string_view::npos;
}

/// The first component of an aggregate such as {X 1,Y 2} or {E6AXIS: A1 0}.
bool IsKrlTarget(const Literal& one, std::string_view components, std::size_t length) {
  std::string_view text = one.inside;
  if (const auto type = text.find(':'); type != std::string_view::npos)
    text.remove_prefix(type + 1);
  const std::string_view word = Trimmed(text).substr(0, Trimmed(text).find_first_of(" \t,"));
  return one.open == '{' && !one.nested && !SetsNoTarget(Trimmed(one.before)) &&
         word.size() == length && components.find(word) != std::string_view::npos;
}

bool IsUrTarget(const Literal& one, bool pose) {
  // Elsewhere, such as in set_tcp() and force_mode(), they are frames, forces and inertias.
  constexpr std::array<std::string_view, 4> kCalls = {"move", "servo", "get_inverse_kin",
                                                      "pose_trans"};
  const bool target = one.call.empty() || std::ranges::any_of(kCalls, [&](std::string_view call) {
                        return one.call.starts_with(call);
                      });
  return target && one.open == '[' && one.counts == std::vector<std::size_t>{6} &&
         one.before.ends_with('p') == pose;
}

bool IsFanucTarget(const Literal& one, bool joints) {
  const bool axes = one.inside.find("J1") < one.inside.find("X ");
  return one.open == '{' && Trimmed(one.before).starts_with("P[") && axes == joints;
}

constexpr TargetForms kKrl = {';', [](const Literal&one) { return IsKrlTarget(one, "XYZ", 1); },
                              [](const Literal&one) {
                                return IsKrlTarget(one, "A1 A2 A3 A4 A5 A6", 2);
                              }},
                      kRapid = {'!',
                                [](const Literal&one) {
                                  return one.counts == std::vector<std::size_t>{3, 4, 4, 6};
                                },
                                [](const Literal&one) {
                                  return one.counts == std::vector<std::size_t>{6, 6};
                                }},
                      kUrScript = {'#', [](const Literal&one) { return IsUrTarget(one, true); },
                                   [](const Literal&one) { return IsUrTarget(one, false); }},
                      kTp = {'!', [](const Literal&one) { return IsFanucTarget(one, false); },
                             [](const Literal&one) { return IsFanucTarget(one, true); }};

/// Calls `visit` for everything in [] and {}, from the inside out.
template <typename Visit>
void ForLiterals(std::string_view text, char comment, const Visit& visit) {
  struct Open {
    char sign;
    std::size_t at, line_start, commas = 0;
    std::vector<std::size_t> counts = {};  // of lists in it
  };
  constexpr std::size_t kDeepest = 32, kMostCounts = 8;
  std::vector<Open> stack;
  std::size_t line_start = 0;
  bool quoted = false, commented = false;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (c == '\n') {
      quoted = commented = false;
      line_start = at + 1;
    }
    if (c == '"' && !commented) quoted = !quoted;
    commented = commented || (c == comment && !quoted);
    if (quoted || commented) continue;
    if (c == '[' || c == '{' || c == '(') {
      if (stack.size() == kDeepest) stack.erase(stack.begin());
      stack.push_back(Open{c, at, line_start});
    } else if (c == ',' && !stack.empty()) {
      ++stack.back().commas;
    } else if (c == ']' || c == '}' || c == ')') {
      const char sign = c == ']' ? '[' : c == '}' ? '{' : '(';
      while (!stack.empty() && stack.back().sign != sign) stack.pop_back();
      if (stack.empty()) continue;
      Open closed = std::move(stack.back());
      stack.pop_back();
      if (sign == '(') continue;
      if (sign == '[' && !stack.empty() && stack.back().counts.size() < kMostCounts) {
        stack.back().counts.push_back(closed.commas + 1);
      }
      if (closed.counts.size() != closed.commas + 1) closed.counts = {closed.commas + 1};
      Literal one;
      one.open = sign;
      one.inside = text.substr(closed.at + 1, at - closed.at - 1);
      one.before = text.substr(closed.line_start, closed.at - closed.line_start);
      one.counts = std::move(closed.counts);
      for (auto outer = stack.rbegin(); outer != stack.rend(); ++outer) {
        one.nested = one.nested || outer->sign == sign;
        if (outer->sign != '(' || !one.call.empty()) continue;
        one.call = Trimmed(text.substr(outer->line_start, outer->at - outer->line_start));
        one.call.remove_prefix(std::min(one.call.find_last_of(" \t(=,") + 1, one.call.size()));
      }
      visit(one);
    }
  }
}

/// The counts of targets as facts, those of positions and those of joints apart.
void AddTargets(const Outline& file, const TargetForms& forms, Recognition& found) {
  struct Count {
    std::size_t count = 0, first = 0;
  };
  Count cartesian, joints;
  ForLiterals(file.text(), forms.comment, [&](const Literal& one) {
    const bool position = forms.cartesian(one);
    if (!position && !forms.joints(one)) return;
    Count& sum = position ? cartesian : joints;
    if (sum.count++ == 0) {
      sum.first = static_cast<std::size_t>(one.inside.data() - file.text().data());
    }
  });
  for (const auto& [what, sum] :
       {std::pair("cartesian targets", cartesian), std::pair("joint targets", joints)}) {
    if (sum.count > 0) AddFact(found, what, fmt::format("{}", sum.count), file.LineAt(sum.first));
  }
}

void CheckEnd(const Outline& file, std::string_view end, Recognition& found) {
  if (InLowerCase(file.text()).find(end) != std::string::npos) return;
  Contradict(found, "end", fmt::format("{} is missing: the program is cut", end),
             file.line_count());
}

void ReadUrScript(const Outline& file, Recognition& found) {
  AddTargets(file, kUrScript, found);
  AddFact(found, "units", "m, rad, rotation vector (URScript)");
}

void ReadKrl(const Outline& file, Recognition& found) {
  AddTargets(file, kKrl, found);
  AddFact(found, "units", "mm, deg; A, B, C about z, y, x (KRL)");
}

/// Contradicts the first robtarget whose orientation is no rotation.
void CheckOrientations(const Outline& file, Recognition& found) {
  const std::size_t before = found.contradictions.size();
  ForLiterals(file.text(), kRapid.comment, [&](const Literal& one) {
    if (!kRapid.cartesian(one) || found.contradictions.size() > before) return;
    const std::size_t start = one.inside.find('[', 1) + 1;
    std::string_view rest = one.inside.substr(start, one.inside.find(']', start) - start);
    std::vector<double> numbers;
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find(','), rest.size());
      if (const auto number = text::NumberIn(Trimmed(rest.substr(0, end)), '.')) {
        numbers.push_back(*number);
      }
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    const auto at = static_cast<std::size_t>(one.inside.data() - file.text().data());
    CheckQuaternion(numbers, 0, found);
    if (found.contradictions.size() > before) {
      found.contradictions.back().line = file.LineAt(at + start);
    }
  });
}

void ReadRapid(const Outline& file, Recognition& found) {
  AddTargets(file, kRapid, found);
  CheckOrientations(file, found);
  AddFact(found, "units", "mm; quaternion, scalar first (RAPID)");
  CheckEnd(file, "endmodule", found);
}

void ReadFanuc(const Outline& file, Recognition& found) {
  AddTargets(file, kTp, found);
  AddFact(found, "units", "mm, deg; W, P, R about fixed x, y, z (TP)");
  CheckEnd(file, "/end", found);
}

void ReadYaskawa(const Outline& file, Recognition& found) {
  if (const Line* const count = file.FindLine("///NPOS")) {
    AddFact(found, "points", Quoted(count->text), count->number);
  }
  if (const Line* const type = file.FindLine("///POSTYPE")) {
    AddFact(found, "points in", Quoted(type->text), type->number);
  }
  if (file.FindLine("///PULSE") != nullptr) {
    found.undecided.emplace_back(
        "angles of points in pulses: the ratios are in the controller's parameter files");
  }
}

constexpr const char* kNotRead =
    "Plumbline does not read these programs. List the points in a CSV with a header (q1_deg .. in "
    "degrees) for `plumbline path CELL.toml POINTS.csv`.";

constexpr const char* kCorrect = "plumbline program CELL.toml {}";

constexpr std::array kProgramKinds = {
    Kind{"krl-program", "a program of a KUKA controller (KRL)", Content::kProgram,
         [](const Outline& file) -> std::optional<Fact> {
           const Line* line = LineWith(file, "&ACCESS");
           if (line == nullptr) line = LineWith(file, "DEFDAT ");
           if (line == nullptr && LineHolding(file, {"$TOOL", "PTP ", "LIN ", "BAS(", "BAS ("})) {
             line = LineWith(file, "DEF ");
             if (line != nullptr && line->text.ends_with(':')) line = nullptr;  // URScript, Python
           }
           return Shown(line);
         },
         ReadKrl, kCorrect, ""},
    Kind{"rapid-program", "a program of an ABB controller (RAPID)", Content::kProgram,
         [](const Outline& file) -> std::optional<Fact> {
           const Line* line = LineWith(file, "MODULE ");
           if (line == nullptr || LineHolding(file, {"robtarget", "MoveJ", "MoveL", "PROC ",
                                                     "PERS ", "CONST ", "VAR "}) == nullptr) {
             line = LineWith(file, "%%%") != nullptr ? LineHolding(file, {"LANGUAGE:"}) : nullptr;
           }
           return Shown(line);
         },
         ReadRapid, kCorrect, ""},
    Kind{"fanuc-program", "a program of a FANUC controller (TP, .ls)", Content::kProgram,
         [](const Outline& file) -> std::optional<Fact> {
           const Line* const line = LineWith(file, "/PROG");
           const bool sections =
               LineWith(file, "/ATTR") != nullptr || LineWith(file, "/MN") != nullptr;
           return sections ? Shown(line) : std::nullopt;
         },
         ReadFanuc, kCorrect, ""},
    Kind{"yaskawa-job", "a job of a Yaskawa controller (.JBI)", Content::kProgram,
         [](const Outline& file) -> std::optional<Fact> {
           const Line* const line = LineWith(file, "/JOB");
           return LineWith(file, "//NAME") != nullptr ? Shown(line) : std::nullopt;
         },
         ReadYaskawa, kCorrect, ""},
    Kind{"as-program", "a program of a Kawasaki controller (AS)", Content::kProgram,
         [](const Outline& file) -> std::optional<Fact> {
           const Line* const line = LineWith(file, ".PROGRAM");
           return Shown(line != nullptr ? line : LineWith(file, ".TRANS"));
         },
         nullptr, "", kNotRead},
    Kind{"val3-program", "a program or data of a Staubli controller (VAL3)", Content::kProgram,
         [](const Outline& file) -> std::optional<Fact> {
           if (file.syntax() != Syntax::kXml || file.entries().empty()) return std::nullopt;
           const Entry& root = file.entries().front();
           const bool val3 = file.text().find("staubli") != std::string::npos ||
                             file.text().find("Staubli") != std::string::npos;
           const bool known =
               root.path == "Programs" || root.path == "Database" || root.path == "Project";
           return val3 && known ? std::optional(Fact{"", "<" + root.path + ">", root.line})
                                : std::nullopt;
         },
         nullptr, "", kNotRead},
    Kind{"urscript", "a program of a Universal Robots controller (URScript)", Content::kProgram,
         [](const Outline& file) -> std::optional<Fact> {
           // At the start of a line, where no comment, text or other language has them.
           constexpr std::array<std::string_view, 8> kCalls = {
               "movej(",   "movel(",       "movep(",           "movec(",
               "set_tcp(", "set_payload(", "get_inverse_kin(", "set_target_payload("};
           if (!IsText(file)) return std::nullopt;
           const auto found = std::ranges::find_if(file.head(), [&](const Line& line) {
             return std::ranges::any_of(
                 kCalls, [&](std::string_view call) { return line.text.starts_with(call); });
           });
           return found == file.head().end() ? std::nullopt : Shown(&*found);
         },
         ReadUrScript, kCorrect, ""},
    Kind{"g-code", "a program in G-code", Content::kProgram,
         [](const Outline& file) -> std::optional<Fact> {
           if (!IsText(file)) return std::nullopt;
           std::size_t codes = 0;
           const Line* first = nullptr;
           for (const Line& line : file.head()) {
             std::string_view text = line.text;
             if (text.front() == 'N' && text.find(' ') != std::string_view::npos) {
               text = text.substr(text.find(' ') + 1);
             }
             // Not the name of a point, as in "G1 100.0 200.0 300.0".
             const std::size_t word =
                 std::min(text.find_first_not_of("0123456789 ", 1), text.size());
             const bool code =
                 text.size() > 1 && text[0] == 'G' && text[1] >= '0' && text[1] <= '9' &&
                 word < text.size() &&
                 std::string_view("XYZFGMTSIJ;(").find(text[word]) != std::string_view::npos;
             codes += code ? 1 : 0;
             if (code && first == nullptr) first = &line;
           }
           return codes >= 3 && codes * 4 >= file.head().size() ? Shown(first) : std::nullopt;
         },
         nullptr, "", kNotRead},
};

}  // namespace

std::span<const Kind> ProgramKinds() {
  return kProgramKinds;
}

}  // namespace plumbline::recognition
