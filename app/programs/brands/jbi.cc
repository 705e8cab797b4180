#include "app/programs/brands/jbi.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <set>

#include "app/programs/brands/arm_sides.h"
#include "app/programs/brands/jbi_routine.h"
#include "app/programs/brands/orientation_branches.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::programs {
namespace jbi {
namespace {

std::optional<long> NumberAfter(std::string_view line, std::string_view word) {
  if (!line.starts_with(word)) return std::nullopt;
  const std::string_view digits = TrimBlanks(line.substr(word.size()));
  long number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (digits.empty() || error != std::errc()) return std::nullopt;
  return number;
}

/// Numbers separated by commas from an offset to the end of the line.
std::vector<std::optional<Number>> NumbersIn(const SourceFile& source, std::size_t file,
                                             std::size_t begin, std::size_t end) {
  std::vector<std::optional<Number>> numbers;
  SourceCursor at(source.bytes, file, begin, end);
  do {
    at.SkipBlanks();
    const auto number = at.TakeNumber();
    if (!number) break;
    numbers.emplace_back(number);
    at.SkipBlanks();
  } while (at.Take(','));
  return numbers;
}

bool IsJob(std::string_view bytes) {
  return bytes.starts_with("/JOB");
}
bool IsToolFile(std::string_view bytes) {
  return bytes.starts_with("//TOOL ");
}

/// TOOL.CND: after `//TOOL n` and lines `///..`, lines of TCP [mm, deg], centre of gravity [mm] and
/// mass [kg]; inertia follows.
void ReadTools(std::size_t file, Program& program) {
  const SourceFile& source = program.files[file];
  const LineIndex lines(source.bytes);
  FrameValue value;
  std::optional<long> tool;
  int part = 0;
  for (int line = 1; line <= lines.count(); ++line) {
    const std::string_view text = lines.Text(line);
    if (const auto number = NumberAfter(text, "//TOOL ")) {
      tool = number;
      value = {};
      value.place = {file, line};
      part = 0;
      continue;
    }
    if (!tool || text.starts_with("//")) continue;
    const auto numbers = NumbersIn(source, file, lines.Begin(line), lines.End(line));
    const std::size_t expected = part == 0 ? 6 : part == 1 ? 3 : 1;
    if (numbers.size() != expected) {
      tool.reset();
      continue;
    }
    const auto at = [&numbers](std::size_t i) { return numbers[i]->value; };
    if (part == 0) {
      const auto R = RotationFromRpyDegrees(std::array{at(3), at(4), at(5)});
      if (R) value.X = {*R, Vec3(at(0), at(1), at(2)) * kMetrePerMm};
    } else if (part == 1) {
      value.load = LoadValue{std::nullopt, Vec3(at(0), at(1), at(2)) * kMetrePerMm};
    } else {
      if (at(0) > 0) value.load->mass_kg = at(0);
      program.tools[fmt::format("TOOL {}", *tool)] = value;
      tool.reset();
    }
    ++part;
  }
}

/// Reads one job.
class Job {
 public:
  Job(std::size_t file, Reading& reading)
      : file_(file), reading_(reading), program_(reading.program) {}

  Routine Read(const std::set<std::string>& assigned) {
    assigned_ = &assigned;
    const SourceFile& source = program_.files[file_];
    const LineIndex lines(source.bytes);
    Routine routine;
    routine.place = {file_, 1};
    bool instructions = false;
    InstructionReader reader(points_, program_, routine);
    for (int line = 1; line <= lines.count(); ++line) {
      const std::string_view text = lines.Text(line);
      if (instructions) {
        if (!text.starts_with("///"))
          reader.Read(text, {file_, line}, {file_, lines.Begin(line), lines.End(line)});
      } else if (text.starts_with("//NAME")) {
        routine.name = std::string(TrimBlanks(text.substr(6)));
        routine.place.line = line;
      } else if (text.starts_with("//INST")) {
        AttachAxes();
        instructions = true;
      } else if (text.starts_with("///")) {
        Header(text, line, lines.Begin(line));
      } else {
        PointLine(source, text, line, lines.Begin(line));
      }
    }
    reader.Finish();
    return routine;
  }

 private:
  void Header(std::string_view text, int line, std::size_t begin) {
    if (const auto tool = NumberAfter(text, "///TOOL ")) tool_ = *tool;
    if (const auto user = NumberAfter(text, "///USER ")) user_ = *user;
    if (text.starts_with("///POSTYPE ")) type_ = std::string(TrimBlanks(text.substr(11)));
    if (text.starts_with("///RECTAN")) pulses_ = false;
    if (text.starts_with("///PULSE")) pulses_ = true;
    if (text.starts_with("///RCONF ")) {
      const std::string_view value = TrimBlanks(text.substr(9));
      const std::size_t at = begin + static_cast<std::size_t>(value.data() - text.data());
      rconf_ = {{{"RCONF", {file_, at, at + value.size()}, std::string(value)}}};
    }
    if (pulses_ && !refused_ && text.starts_with("///PULSE")) {
      refused_ = true;
      reading_.refusals.push_back(
          {file_, line, "points in pulses of the motors",
           "convert the job to a relative job on the controller (its points are then poses, "
           "///RECTAN); pulses would need the pulses for a degree, the zero and the wrist coupling "
           "of each axis"});
    }
  }

  void PointLine(const SourceFile& source, std::string_view text, int line, std::size_t begin) {
    const auto equals = text.find('=');
    if (equals == std::string_view::npos || equals > 16) return;
    const std::string name(TrimBlanks(text.substr(0, equals)));
    auto numbers = NumbersIn(source, file_, begin + equals + 1, begin + text.size());
    if (numbers.empty()) return;
    const std::size_t letters = std::min(name.find_first_of("0123456789"), name.size());
    const std::string_view kind = std::string_view(name).substr(0, letters);
    const auto number = PointNumber("C" + name.substr(letters));
    if (!number) return;
    if (kind == "BC" || kind == "EC") {
      base_axes_ |= kind == "BC";
      auto& axes = axes_[*number];
      axes.insert(axes.end(), numbers.begin(), numbers.end());
      return;
    }
    if (kind != "C" && kind != "P") return;  // BP, EX: axes of position variables
    Point point;
    point.name = name;
    point.place = {file_, line};
    point.kind = pulses_ ? PointKind::kJoints : PointKind::kPose;
    point.untouchable = Untouchable(kind, numbers.size());
    if (!pulses_ && numbers.size() > 6) numbers.resize(6);
    point.numbers = std::move(numbers);
    if (!pulses_) point.configuration = rconf_;
    const PointHeader header{program_.points.size(), ToolSetting(), BaseSetting()};
    point.stated_tool = header.tool.key;
    point.stated_base = header.base.key;
    if (kind == "C" && !points_.emplace(*number, header).second)
      point.untouchable = name + " is written twice in this job";
    program_.points.push_back(std::move(point));
  }

  std::string Untouchable(std::string_view kind, std::size_t count) const {
    if (pulses_) return "in pulses of the motors: not read";
    if (kind == "P") return "position variable: every job may change it";
    if (count > 6) return "arm with more than six axes";
    if (type_ == "TOOL" || type_ == "MTOOL") return "relative to a tool (///POSTYPE " + type_ + ")";
    if (count < 6) return "fewer than six numbers";
    return "";
  }

  Setting Numbered(std::string_view what, std::optional<long> number) const {
    if (!number) return {"", fmt::format("no ///{} before the point", what)};
    const std::string key = fmt::format("{} {}", what, *number);
    if (assigned_->contains(key) || assigned_->contains(fmt::format("{} *", what)))
      return {"", key + " is assigned by a job"};
    return {key, ""};
  }
  Setting ToolSetting() const { return Numbered("TOOL", tool_); }
  Setting BaseSetting() const {
    if (type_ == "USER") return Numbered("USER", user_);
    if (type_ == "ROBOT" || type_ == "BASE") return {type_, ""};
    return {"", "///POSTYPE " + (type_.empty() ? "missing" : type_)};
  }

  /// Axes of the base and of stations belong to the points with their numbers.
  void AttachAxes() {
    for (auto& [number, axes] : axes_) {
      const auto found = points_.find(number);
      if (found == points_.end()) continue;
      program_.points[found->second.point].external_axes = std::move(axes);
    }
    if (!base_axes_) return;
    for (auto& [number, header] : points_) {
      if (header.base.key == "BASE") header.base = {"", "the robot is on base axes (BC)"};
      program_.points[header.point].stated_base = header.base.key;
    }
  }

  std::size_t file_;
  Reading& reading_;
  Program& program_;
  const std::set<std::string>* assigned_ = nullptr;
  PointHeaders points_;
  std::map<long, std::vector<std::optional<Number>>> axes_;
  std::optional<long> tool_, user_;
  std::string type_;
  bool pulses_ = true, refused_ = false, base_axes_ = false;
  Configuration rconf_;
};

/// Tools and user frames that instructions assign: SETTOOL TL#(1), MFRAME UF#(2), SETUFRAME.
void FindAssigned(std::string_view bytes, std::set<std::string>& assigned) {
  struct Written {
    std::string_view instruction, argument, key;
  };
  static constexpr std::array kWritten = {Written{"SETTOOL", "TL#(", "TOOL"},
                                          Written{"MFRAME", "UF#(", "USER"},
                                          Written{"SETUFRAME", "UF#(", "USER"}};
  const LineIndex lines(bytes);
  for (int line = 1; line <= lines.count(); ++line) {
    const std::string_view text = TrimBlanks(lines.Text(line));
    for (const Written& written : kWritten) {
      if (!text.starts_with(written.instruction)) continue;
      const auto at = text.find(written.argument);
      const auto number = at == std::string_view::npos
                              ? std::nullopt
                              : NumberAfter(text.substr(at), written.argument);
      assigned.insert(number ? fmt::format("{} {}", written.key, *number)
                             : fmt::format("{} *", written.key));
    }
  }
}

/// The values of ///RCONF, at most `limit`.
std::vector<int> ValuesOf(std::string_view text, std::size_t limit) {
  std::vector<int> values;
  while (values.size() < limit) {
    int value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc()) break;
    values.push_back(value);
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (!text.starts_with(',')) break;
    text.remove_prefix(1);
  }
  return values;
}

class Yaskawa final : public Brand {
 public:
  std::string_view name() const override { return "Yaskawa INFORM"; }

  const Conventions& conventions() const override {
    static const Conventions kConventions = [] {
      Conventions conventions;
      conventions.length = {.least_decimals = 3, .exponent = false};
      conventions.angle = {.least_decimals = 4, .exponent = false};
      conventions.turn = 360;
      conventions.rotation = RotationFromRpyDegrees;
      conventions.numbers = RpyDegreesNear;
      return conventions;
    }();
    return kConventions;
  }

  bool Recognises(const SourceFile& file) const override {
    return IsJob(file.bytes) || IsToolFile(file.bytes);
  }

  Reading Read(std::vector<SourceFile> files) const override {
    Reading reading;
    Program& program = reading.program;
    program.files = std::move(files);
    program.marks.resize(program.files.size());
    program.bases["ROBOT"] = {};
    program.bases["BASE"] = {};
    std::set<std::string> assigned, called;
    for (std::size_t file = 0; file < program.files.size(); ++file) {
      if (IsToolFile(program.files[file].bytes)) {
        ReadTools(file, program);
      } else {
        FindAssigned(program.files[file].bytes, assigned);
      }
    }
    for (std::size_t file = 0; file < program.files.size(); ++file) {
      if (!IsJob(program.files[file].bytes)) continue;
      program.routines.push_back(Job(file, reading).Read(assigned));
      for (const Step& step : program.routines.back().steps) {
        if (step.kind == StepKind::kCall) called.insert(step.label);
      }
    }
    for (Routine& routine : program.routines) routine.starts = !called.contains(routine.name);
    return reading;
  }

  bool Agrees(const Configuration& stated, const kinematics::Chain& chain,
              const model::JointVector& q, MotionKind kind) const override {
    constexpr double kAtLimit = 1e-4;
    if (stated.fields.empty()) return true;
    const std::vector<int> values = ValuesOf(stated.fields.front().text, 6);
    const auto sides = ArmSidesOf(chain, q);
    if (values.size() < 6 || !sides) return true;
    const auto agrees = [](double side, int value) {
      return std::abs(side) < kAtLimit || (side > 0) == (value == 0);
    };
    if (!agrees(sides->elbow_up, values[1]) || !agrees(sides->front, values[2])) return false;
    if (kind != MotionKind::kJoint) return true;
    constexpr std::array<int, 3> kJoints = {3, 5, 0};  // R, T, S
    for (std::size_t i = 0; i < 3; ++i) {
      const double beyond = std::numbers::pi - std::abs(q[kJoints[i]]);
      if (!agrees(beyond, values[3 + i])) return false;
    }
    return true;
  }

  std::vector<std::string> ConfigurationOf(const Configuration& stated, const kinematics::Chain&,
                                           const model::JointVector&) const override {
    std::vector<std::string> texts;
    for (const Configuration::Field& field : stated.fields) texts.push_back(field.text);
    return texts;
  }

  std::optional<Insertion> Mark(const SourceFile&, std::string_view) const override {
    return std::nullopt;
  }
};

}  // namespace
}  // namespace jbi

const Brand& YaskawaJbi() {
  static const jbi::Yaskawa kYaskawa;
  return kYaskawa;
}

}  // namespace plumbline::programs
