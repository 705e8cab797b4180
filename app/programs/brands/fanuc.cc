#include "app/programs/brands/fanuc.h"

#include <fmt/format.h>

#include "app/programs/brands/fanuc_backup.h"
#include "app/programs/brands/fanuc_posture.h"
#include "app/programs/brands/fanuc_routine.h"
#include "app/programs/brands/orientation_branches.h"

namespace plumbline::programs {
namespace fanuc {
namespace {

/// Bytes of a section, from the line after its name to the next name.
struct Sections {
  std::string name;  ///< of the program, in capitals
  int name_line = 1;
  SourceCursor statements, positions;
};

Sections SectionsOf(const SourceFile& source, std::size_t file, const LineIndex& lines) {
  const SourceCursor none(source.bytes, file, 0, 0);
  Sections sections{"", 1, none, none};
  SourceCursor* open = nullptr;
  std::size_t begin = 0;
  const auto close = [&](std::size_t end) {
    if (open != nullptr) *open = SourceCursor(source.bytes, file, begin, end);
    open = nullptr;
  };
  for (int line = 1; line <= lines.count(); ++line) {
    const std::string_view text = lines.Text(line);
    if (!text.starts_with('/') || text.size() < 3 || !IsLetter(text[1])) continue;
    SourceCursor at(text, file);
    at.Skip();
    const std::string_view section = at.TakeWord();
    close(lines.Begin(line));
    begin = line < lines.count() ? lines.Begin(line + 1) : source.bytes.size();
    if (section == "PROG") {
      at.SkipBlanks();
      sections.name = Capitals(at.TakeWord("-"));
      sections.name_line = line;
    } else if (section == "MN") {
      open = &sections.statements;
    } else if (section == "POS") {
      open = &sections.positions;
    }
  }
  close(source.bytes.size());
  return sections;
}

bool IsListing(const SourceFile& file) {
  const std::string_view bytes(file.bytes);
  const auto begin = bytes.find_first_not_of(" \t\r\n");
  return begin != std::string_view::npos && begin < 4096 && bytes.substr(begin, 5) == "/PROG";
}

bool IsCompiled(const SourceFile& file) {
  return Lowered(file.name).ends_with(".tp") && !IsListing(file);
}

class Fanuc final : public Brand {
 public:
  std::string_view name() const override { return "FANUC TP"; }

  const Conventions& conventions() const override {
    static const Conventions kConventions = [] {
      Conventions conventions;
      conventions.length = {.least_decimals = 3, .fixed = true, .exponent = false};
      conventions.angle = conventions.length;
      conventions.turn = 360;
      conventions.rotation = RotationFromRpyDegrees;
      conventions.numbers = RpyDegreesNear;
      return conventions;
    }();
    return kConventions;
  }

  bool Recognises(const SourceFile& file) const override {
    return IsListing(file) || IsVariableListing(file.bytes) || IsCompiled(file);
  }

  Reading Read(std::vector<SourceFile> files) const override {
    Reading reading;
    Program& program = reading.program;
    program.files = std::move(files);
    program.marks.resize(program.files.size());
    program.points_state_frames = true;
    program.bases[BaseKey(0)] = {};
    program.tools[ToolKey(0)] = {};

    struct Source {
      PointNumbers points;
      std::vector<Statement> statements;
      Routine routine;
    };
    std::vector<Source> sources;
    std::set<std::string> shifts;
    Assigned assigned;
    for (std::size_t file = 0; file < program.files.size(); ++file) {
      const SourceFile& source = program.files[file];
      if (IsVariableListing(source.bytes)) {
        ReadVariableListing(file, program);
        continue;
      }
      if (!IsListing(source)) {
        reading.refusals.push_back(
            {file, 1, "a compiled program (.tp)", "save it on the controller as a listing (.LS)"});
        continue;
      }
      const LineIndex lines(source.bytes);
      const Sections sections = SectionsOf(source, file, lines);
      Source& read = sources.emplace_back();
      read.points = ReadPositions(sections.positions, lines, program);
      read.statements = StatementsOf(sections.statements, file, lines);
      read.routine.name = sections.name.empty() ? fmt::format("program {}", file) : sections.name;
      read.routine.place = {file, sections.name_line};
      FindAssigned(read.statements, source.name, assigned);
      FindShifts(read.statements, shifts);
    }
    std::set<std::string> called;
    for (Source& source : sources) {
      ReadRoutine(source.statements, {&source.points, &shifts, &assigned}, program, source.routine);
      called.merge(CalledBy(source.routine));
    }
    for (Source& source : sources) {
      source.routine.starts = !called.contains(source.routine.name);
      program.routines.push_back(std::move(source.routine));
    }
    return reading;
  }

  bool Agrees(const Configuration& stated, const kinematics::Chain& chain,
              const model::JointVector& q, MotionKind kind) const override {
    return stated.fields.empty() ||
           ConfigAgrees(stated.fields.front().text, chain, q, kind == MotionKind::kJoint);
  }

  std::vector<std::string> ConfigurationOf(const Configuration& stated,
                                           const kinematics::Chain& chain,
                                           const model::JointVector& q) const override {
    std::vector<std::string> texts;
    for (const Configuration::Field& field : stated.fields) {
      texts.push_back(ConfigFor(field.text, chain, q));
    }
    return texts;
  }

  std::optional<Insertion> Mark(const SourceFile&, std::string_view) const override {
    return std::nullopt;
  }
};

}  // namespace
}  // namespace fanuc

const Brand& FanucTp() {
  static const fanuc::Fanuc kFanuc;
  return kFanuc;
}

}  // namespace plumbline::programs
