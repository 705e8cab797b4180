#include "app/programs/brands/krl.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "app/programs/brands/krl_names.h"
#include "app/programs/brands/krl_posture.h"
#include "app/programs/brands/krl_routines.h"
#include "app/programs/brands/krl_text.h"
#include "app/programs/brands/orientation_branches.h"

namespace plumbline::programs {
namespace {

constexpr std::string_view kMarkStart = "; Plumbline: ";

/// The line with DEF or DEFDAT; 0 if there is none.
int HeadLine(const SourceFile& file, const LineIndex& lines) {
  int head = 0;
  krl::ForStatements(file, 0, lines, [&](const krl::Statement& statement) {
    for (std::size_t at = 0; head == 0 && at < std::min<std::size_t>(3, statement.size()); ++at) {
      if (statement.HasWord(at, "DEF") || statement.HasWord(at, "DEFDAT") ||
          statement.HasWord(at, "DEFFCT")) {
        head = statement.line;
      }
    }
  });
  return head;
}

std::string KrlMarkIn(const SourceFile& file, const LineIndex& lines) {
  const int head = HeadLine(file, lines);
  if (head == 0 || head >= lines.count()) return "";
  const std::string_view text = lines.Text(head + 1);
  return text.starts_with(kMarkStart) ? std::string(text.substr(kMarkStart.size())) : "";
}

/// A number without trailing zeros: "12.5", "0.0".
std::string ShortNumber(double value, int decimals) {
  std::string text = fmt::format("{:.{}f}", value, decimals);
  while (text.ends_with('0') && !text.ends_with(".0")) text.pop_back();
  return text == "-0.0" ? "0.0" : text;
}

class Krl final : public Brand {
 public:
  std::string_view name() const override { return "KUKA KRL"; }

  const Conventions& conventions() const override {
    // Rounding to a thousandth of a degree moves the tip of a 1 m tool by at most 9 um.
    static const Conventions kConventions = [] {
      Conventions conventions;
      conventions.length.least_significant = 0;
      conventions.length.least_decimals = 3;
      conventions.angle = conventions.length;
      conventions.turn = 360;
      conventions.rotation = RotationFromAbcDegrees;
      conventions.numbers = AbcDegreesNear;
      return conventions;
    }();
    return kConventions;
  }

  bool Recognises(const SourceFile& file) const override {
    const bool named = std::ranges::any_of(
        std::array<std::string_view, 3>{".src", ".dat", ".sub"}, [&](std::string_view ending) {
          return file.name.size() > ending.size() &&
                 SameWord(std::string_view(file.name).substr(file.name.size() - ending.size()),
                          ending);
        });
    // The header lines and comments in front of DEF are short.
    constexpr std::size_t kHead = 65536;
    const SourceFile head{file.name, file.bytes.substr(0, kHead)};
    if (head.bytes.starts_with("&ACCESS")) return true;
    return named && HeadLine(head, LineIndex(head.bytes)) > 0;
  }

  Reading Read(std::vector<SourceFile> files) const override {
    Reading reading;
    reading.program.files = std::move(files);
    std::vector<LineIndex> lines;
    for (const SourceFile& file : reading.program.files) {
      lines.emplace_back(file.bytes);
      reading.program.marks.push_back(KrlMarkIn(file, lines.back()));
    }
    krl::Names names(reading, lines);
    krl::ReadRoutines(reading, names, lines);
    LeaveUnusedExternalAxes(reading.program);
    return reading;
  }

  bool Agrees(const Configuration& stated, const kinematics::Chain& chain,
              const model::JointVector& q, MotionKind kind) const override {
    // A path motion keeps the posture in which it starts.
    if (kind != MotionKind::kJoint) return true;
    const auto posture = krl::PostureOf(chain, q);
    if (!posture) return true;
    return std::ranges::all_of(stated.fields, [&](const Configuration::Field& field) {
      const auto bits = krl::WholeNumberIn(field.text);
      if (!bits || *bits < 0) return true;
      const bool status = field.key == "S";
      const std::int64_t differ = *bits ^ (status ? posture->status : posture->turn);
      const std::int64_t open = status ? posture->open_status : posture->open_turn;
      return (differ & ~open & (status ? kStatusBits : kTurnBits)) == 0;
    });
  }

  std::vector<std::string> ConfigurationOf(const Configuration& stated,
                                           const kinematics::Chain& chain,
                                           const model::JointVector& q) const override {
    std::vector<std::string> texts;
    const auto posture = krl::PostureOf(chain, q);
    for (const Configuration::Field& field : stated.fields) {
      const auto bits = krl::WholeNumberIn(field.text);
      texts.push_back(field.text);
      if (!posture || !bits || *bits < 0) continue;
      const bool status = field.key == "S";
      const std::int64_t used = status ? kStatusBits : kTurnBits;
      const std::int64_t now = (*bits & ~used) | (status ? posture->status : posture->turn);
      if (now != *bits) texts.back() = krl::WholeNumberLike(field.text, now);
    }
    return texts;
  }

  /// The line behind DEF or DEFDAT: the controller's own files have a comment there (;FOLD INI,
  /// ;FOLD EXTERNAL DECLARATIONS), whereas the header lines with & must come first.
  std::optional<Insertion> Mark(const SourceFile& file, std::string_view mark) const override {
    const LineIndex lines(file.bytes);
    const int head = HeadLine(file, lines);
    if (head == 0) return std::nullopt;
    std::string text = std::string(kMarkStart) + std::string(mark);
    std::ranges::replace_if(text, IsLineEnd, ' ');
    const std::string_view line_end = lines.UsualLineEnd();
    if (head == lines.count()) {
      return Insertion{lines.End(head), std::string(line_end) + text + std::string(line_end)};
    }
    return Insertion{lines.Begin(head + 1), text + std::string(line_end)};
  }

  std::optional<std::string> InsertedMotion(const Program& program, const Motion& motion,
                                            std::span<const double> numbers, double) const override;

 private:
  static constexpr std::int64_t kStatusBits = 7, kTurnBits = 63;

  /// Every pose states E1 to E6; those that are zero in all points are not there.
  static void LeaveUnusedExternalAxes(Program& program) {
    for (std::size_t axis = 0; axis < 6; ++axis) {
      const bool used = std::ranges::any_of(program.points, [&](const Point& point) {
        const auto& number = point.external_axes[axis];
        return number && number->value != 0;
      });
      for (Point& point : program.points) {
        if (!used) point.external_axes[axis].reset();
      }
    }
    for (Point& point : program.points) {
      while (!point.external_axes.empty() && !point.external_axes.back()) {
        point.external_axes.pop_back();
      }
    }
  }
};

/// The statement with the target replaced: `LIN {X ...} C_DIS`, `SCIRC {X ...}, {X ...} WITH ...`.
/// A circle needs the auxiliary point of its part in front of the end: twelve numbers.
std::optional<std::string> Krl::InsertedMotion(const Program& program, const Motion& motion,
                                               std::span<const double> numbers, double) const {
  const bool circle = motion.kind == MotionKind::kCircular;
  if ((motion.kind != MotionKind::kLinear && !circle) || numbers.size() != (circle ? 12u : 6u) ||
      !motion.special.empty() || motion.statement.file >= program.files.size()) {
    return std::nullopt;
  }
  const std::string_view bytes = program.files[motion.statement.file].bytes;
  krl::Statement statement;
  statement.file = motion.statement.file;
  statement.tokens = krl::TokensOf(bytes, motion.statement.begin, motion.statement.end);
  const auto form = krl::MotionIn(statement);
  if (!form || form->targets.empty()) return std::nullopt;
  const auto pose = [&](std::span<const double> six) {
    constexpr std::string_view kNames = "XYZABC";
    std::string text = "{";
    for (std::size_t i = 0; i < six.size(); ++i) {
      text +=
          fmt::format("{}{} {}", i > 0 ? "," : "", kNames[i], ShortNumber(six[i], i < 3 ? 4 : 5));
    }
    return text + "}";
  };
  std::string text(statement.tokens.front().text);
  text += " " + pose(numbers.first(6));
  if (circle) text += ", " + pose(numbers.subspan(6));
  if (form->behind_targets < statement.size()) {
    text += " ";
    text += statement.Text(form->behind_targets, statement.size(), bytes);
  }
  // The statement keeps its indentation, and so does the line that is inserted in front of it.
  std::size_t line = motion.statement.begin;
  while (line > 0 && !IsLineEnd(bytes[line - 1])) --line;
  std::size_t end = motion.statement.end;
  while (end < bytes.size() && !IsLineEnd(bytes[end])) ++end;
  std::string_view line_end = "\n";
  if (end < bytes.size()) line_end = bytes.substr(end, bytes.substr(end, 2) == "\r\n" ? 2 : 1);
  text += line_end;
  text += bytes.substr(line, motion.statement.begin - line);
  return text;
}

}  // namespace

const Brand& KrlBrand() {
  static const Krl kKrl;
  return kKrl;
}

}  // namespace plumbline::programs
