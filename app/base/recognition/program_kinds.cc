// Programs of robot controllers. Plumbline reads none; points that are taught in them are counted.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "app/base/recognition/kinds.h"

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

void AddPoints(const Outline& file, std::string_view part, Recognition& found) {
  const std::size_t count = CountIn(file.text(), part);
  if (count > 0) {
    AddFact(found, "points", fmt::format("{}", count), file.LineAt(file.text().find(part) + 1));
  }
}

void CheckEnd(const Outline& file, std::string_view end, Recognition& found) {
  if (InLowerCase(file.text()).find(end) != std::string::npos) return;
  Contradict(found, "end", fmt::format("{} is missing: the program is cut", end),
             file.line_count());
}

void ReadUrScript(const Outline& file, Recognition& found) {
  AddPoints(file, "p[", found);
  AddFact(found, "units", "m, rad, rotation vector (URScript)");
}

/// Points with the accurate-model bit of the status are corrected by the controller already.
void ReadKrl(const Outline& file, Recognition& found) {
  AddPoints(file, "{X ", found);
  AddFact(found, "units", "mm, deg; A, B, C about z, y, x (KRL)");
}

void ReadRapid(const Outline& file, Recognition& found) {
  const std::size_t points = CountIn(file.text(), "robtarget");
  if (points > 0) AddFact(found, "robtargets", fmt::format("{}", points));
  AddFact(found, "units", "mm; quaternion, scalar first (RAPID)");
  CheckEnd(file, "endmodule", found);
}

void ReadFanuc(const Outline& file, Recognition& found) {
  AddPoints(file, "\nP[", found);
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

constexpr const char* kPoints =
    "Plumbline reads no robot programs. List the points in a CSV with a header (q1_deg .. in "
    "degrees) for `plumbline predict CELL.toml POINTS.csv`.";

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
         ReadKrl, "", kPoints},
    Kind{"rapid-program", "a program of an ABB controller (RAPID)", Content::kProgram,
         [](const Outline& file) -> std::optional<Fact> {
           const Line* line = LineWith(file, "MODULE ");
           if (line == nullptr || LineHolding(file, {"robtarget", "MoveJ", "MoveL", "PROC ",
                                                     "PERS ", "CONST ", "VAR "}) == nullptr) {
             line = LineWith(file, "%%%") != nullptr ? LineHolding(file, {"LANGUAGE:"}) : nullptr;
           }
           return Shown(line);
         },
         ReadRapid, "", kPoints},
    Kind{"fanuc-program", "a program of a FANUC controller (TP, .ls)", Content::kProgram,
         [](const Outline& file) -> std::optional<Fact> {
           const Line* const line = LineWith(file, "/PROG");
           const bool sections =
               LineWith(file, "/ATTR") != nullptr || LineWith(file, "/MN") != nullptr;
           return sections ? Shown(line) : std::nullopt;
         },
         ReadFanuc, "", kPoints},
    Kind{"yaskawa-job", "a job of a Yaskawa controller (.JBI)", Content::kProgram,
         [](const Outline& file) -> std::optional<Fact> {
           const Line* const line = LineWith(file, "/JOB");
           return LineWith(file, "//NAME") != nullptr ? Shown(line) : std::nullopt;
         },
         ReadYaskawa, "", kPoints},
    Kind{"as-program", "a program of a Kawasaki controller (AS)", Content::kProgram,
         [](const Outline& file) -> std::optional<Fact> {
           const Line* const line = LineWith(file, ".PROGRAM");
           return Shown(line != nullptr ? line : LineWith(file, ".TRANS"));
         },
         nullptr, "", kPoints},
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
         nullptr, "", kPoints},
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
         ReadUrScript, "", kPoints},
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
         nullptr, "", kPoints},
};

}  // namespace

std::span<const Kind> ProgramKinds() {
  return kProgramKinds;
}

}  // namespace plumbline::recognition
