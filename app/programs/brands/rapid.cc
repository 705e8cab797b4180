#include "app/programs/brands/rapid.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>

#include "app/programs/brands/orientation_branches.h"
#include "app/programs/brands/rapid_declarations.h"
#include "app/programs/brands/rapid_instructions.h"
#include "app/programs/brands/rapid_posture.h"
#include "app/programs/brands/rapid_routine.h"
#include "app/programs/brands/rapid_tokens.h"
#include "app/programs/brands/rapid_values.h"

namespace plumbline::programs {

namespace rapid {

namespace {

constexpr std::string_view kMarkStart = "! Plumbline: ";

Result<Mat3> RotationOfRapid(std::span<const double> numbers) {
  const Eigen::Quaterniond q(numbers[0], numbers[1], numbers[2], numbers[3]);
  constexpr double kLeast = 0.1;
  if (!(q.norm() > kLeast) || !std::isfinite(q.norm())) {
    return Error{fmt::format("the quaternion [{}, {}, {}, {}] is no rotation: its length is not 1",
                             numbers[0], numbers[1], numbers[2], numbers[3])};
  }
  return q.normalized().toRotationMatrix();
}

const Conventions& ConventionsOfRapid() {
  static const Conventions kConventions = [] {
    Conventions conventions;
    conventions.orientation_numbers = 4;
    // A controller keeps single precision and prints six digits and more.
    conventions.length = {6, 3, false, false, true};
    conventions.angle = {6, 6, false, false, true};
    conventions.rotation = RotationOfRapid;
    conventions.numbers = QuaternionNear;
    return conventions;
  }();
  return kConventions;
}

bool EndsWith(std::string_view name, std::string_view ending) {
  return name.size() >= ending.size() && SameWord(name.substr(name.size() - ending.size()), ending);
}

/// True for bytes that are no text of a module: an encoded module, another binary file.
bool IsBinary(std::string_view bytes) {
  constexpr std::size_t kLooked = 4096;
  const std::string_view start = bytes.substr(0, kLooked);
  return std::any_of(start.begin(), start.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < ' ' && c != '\t' && c != '\n' && c != '\r' && c != '\f' && c != '\x1a';
  });
}

/// Whether the first word, after comments and the header, is `word`.
bool StartsWith(std::string_view bytes, std::string_view word) {
  constexpr std::size_t kLooked = 20'000;
  const TokenFile start(bytes.substr(0, kLooked), 0);
  return start.IsWord(0, word);
}

bool IsModuleList(const SourceFile& file) {
  return EndsWith(file.name, ".pgf") && file.bytes.find("<Module>") != std::string::npos;
}

class RapidBrand final : public Brand {
 public:
  std::string_view name() const override { return "ABB RAPID"; }
  const Conventions& conventions() const override { return ConventionsOfRapid(); }

  bool Recognises(const SourceFile& file) const override {
    const bool module = EndsWith(file.name, ".mod") || EndsWith(file.name, ".sys") ||
                        EndsWith(file.name, ".prg") || EndsWith(file.name, ".modx") ||
                        EndsWith(file.name, ".sysx");
    if (IsModuleList(file)) return true;
    if (IsBinary(file.bytes)) return module;
    return StartsWith(file.bytes, "MODULE") && HasEnd(file.bytes);
  }

  Reading Read(std::vector<SourceFile> files) const override;

  bool Agrees(const Configuration& stated, const kinematics::Chain& chain,
              const model::JointVector& q, MotionKind) const override {
    return AgreesWithConfdata(stated, chain, q);
  }

  std::vector<std::string> ConfigurationOf(const Configuration& stated,
                                           const kinematics::Chain& chain,
                                           const model::JointVector& q) const override {
    return ConfdataOf(stated, chain, q);
  }

  std::optional<Insertion> Mark(const SourceFile& file, std::string_view mark) const override;
  std::optional<std::string> InsertedMotion(const Program& program, const Motion& motion,
                                            std::span<const double> numbers, double) const override;

 private:
  /// ENDMODULE near the end; Go's go.mod files also start with a word `module`.
  static bool HasEnd(std::string_view bytes) {
    constexpr std::size_t kLooked = 2000;
    const std::string end = Lowered(bytes.substr(bytes.size() - std::min(bytes.size(), kLooked)));
    return end.find("endmodule") != std::string::npos;
  }
};

/// The modules that a .pgf file lists and that were not given.
void RemarkMissingModules(std::size_t file, Program& program) {
  const std::string& bytes = program.files[file].bytes;
  constexpr std::string_view kOpen = "<Module>", kClose = "</Module>";
  const LineIndex lines(bytes);
  for (std::size_t at = bytes.find(kOpen); at != std::string::npos; at = bytes.find(kOpen, at)) {
    at += kOpen.size();
    const std::size_t end = bytes.find(kClose, at);
    if (end == std::string::npos) return;
    const std::string_view module = TrimBlanks(std::string_view(bytes).substr(at, end - at));
    const bool given =
        std::any_of(program.files.begin(), program.files.end(),
                    [&](const SourceFile& one) { return EndsWith(one.name, module); });
    if (!given) {
      program.remarks.push_back(
          {{file, lines.LineAt(at)}, fmt::format("the module {} was not given", module)});
    }
  }
}

std::string MarkIn(std::string_view bytes) {
  const std::size_t at = bytes.find(kMarkStart);
  if (at == std::string_view::npos) return "";
  const std::size_t begin = at + kMarkStart.size();
  return std::string(bytes.substr(begin, bytes.find_first_of("\r\n", begin) - begin));
}

Reading RapidBrand::Read(std::vector<SourceFile> files) const {
  Reading reading;
  Program& program = reading.program;
  program.files = std::move(files);
  std::deque<TokenFile> tokens;
  for (std::size_t i = 0; i < program.files.size(); ++i) {
    const SourceFile& file = program.files[i];
    const bool binary = IsBinary(file.bytes);
    if (binary) {
      reading.refusals.push_back(
          {i, 1, "an encoded RAPID module, or another file that is not text",
           "give the module as text: save it from a system in which it is not encoded"});
    }
    const bool list = IsModuleList(file);
    if (list && !binary) RemarkMissingModules(i, program);
    program.marks.push_back(binary ? "" : MarkIn(file.bytes));
    tokens.emplace_back(binary || list ? std::string_view() : std::string_view(file.bytes), i);
  }
  const Declarations declarations(tokens, program);
  Values values(declarations, program);
  values.MarkAssigned();
  Lowering(declarations, values, program).LowerAll();
  return reading;
}

std::optional<Brand::Insertion> RapidBrand::Mark(const SourceFile& file,
                                                 std::string_view mark) const {
  if (IsBinary(file.bytes) || IsModuleList(file)) return std::nullopt;
  const TokenFile tokens(file.bytes, 0);
  for (std::size_t i = 0; i < tokens.size(); ++i) {
    if (!tokens.IsWord(i, "MODULE")) continue;
    std::size_t last = i + 1;
    if (tokens.IsSign(last + 1, '(')) last = tokens.AfterBracket(last + 1) - 1;
    // Behind the line of MODULE and its attributes, which may be more than one line.
    const LineIndex lines(file.bytes);
    const int line = lines.LineAt(tokens[last].begin);
    if (lines.LineEnd(line).empty()) return std::nullopt;
    return Insertion{lines.End(line) + lines.LineEnd(line).size(),
                     fmt::format("  {}{}{}", kMarkStart, mark, lines.LineEnd(line))};
  }
  return std::nullopt;
}

std::string Literal(std::span<const double> numbers) {
  return fmt::format("[[{:.7g},{:.7g},{:.7g}],[{:.7g},{:.7g},{:.7g},{:.7g}]", numbers[0],
                     numbers[1], numbers[2], numbers[3], numbers[4], numbers[5], numbers[6]);
}

std::optional<std::string> RapidBrand::InsertedMotion(const Program& program, const Motion& motion,
                                                      std::span<const double> numbers,
                                                      double) const {
  const Span& span = motion.statement;
  if (span.begin >= span.end || !motion.end.point) return std::nullopt;
  const std::string_view bytes = program.files[span.file].bytes;
  const TokenFile tokens(bytes.substr(0, span.end).substr(span.begin), span.file);
  const bool circle = tokens.IsWord(0, "MoveC");
  if (!(circle || tokens.IsWord(0, "MoveL")) || numbers.size() != (circle ? 14U : 7U)) {
    return std::nullopt;
  }
  // The posture and external axes are those of the point that the motion ends at.
  const Point& point = program.points[*motion.end.point];
  if (point.kind != PointKind::kPose || point.configuration.fields.size() != 4) return std::nullopt;
  const Span& first = point.configuration.fields.front().span;
  const std::string_view source = program.files[first.file].bytes;
  const std::size_t begin = source.rfind('[', first.begin);
  const std::size_t end = source.find(']', source.find(']', first.begin) + 1);
  if (begin == std::string_view::npos || end == std::string_view::npos) return std::nullopt;
  const std::string rest = fmt::format(",{}]", source.substr(begin, end + 1 - begin));

  const Range all{&tokens, 1, tokens.size() - (tokens.IsSign(tokens.size() - 1, ';') ? 1 : 0)};
  std::vector<Range> targets;
  for (const Argument& argument : ArgumentsOf(all)) {
    if (argument.name.empty()) targets.push_back(argument.value);
  }
  const std::size_t count = circle ? 2 : 1;
  if (targets.size() < count) return std::nullopt;
  std::string text;
  std::size_t at = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t from = tokens[targets[i].begin].begin;
    text += bytes.substr(span.begin + at, from - at);
    text += Literal(numbers.subspan(7 * i, 7)) + rest;
    at = tokens[targets[i].end - 1].end;
  }
  text += bytes.substr(span.begin + at, span.end - span.begin - at);
  const LineIndex lines(bytes);
  const int line = lines.LineAt(span.begin);
  const std::string_view before = bytes.substr(lines.Begin(line), span.begin - lines.Begin(line));
  const bool alone = TrimBlanks(before).empty();
  text += alone ? std::string(lines.UsualLineEnd()) + std::string(before) : " ";
  return text;
}

}  // namespace

}  // namespace rapid

const Brand& Rapid() {
  static const rapid::RapidBrand kBrand;
  return kBrand;
}

}  // namespace plumbline::programs
