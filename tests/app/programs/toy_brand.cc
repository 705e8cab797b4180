#include "tests/app/programs/toy_brand.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <map>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::test {
namespace {

using namespace programs;

struct Word {
  std::string text;
  Span span;
};

Mat3 FromTurn(std::span<const double> n) {
  return RotationFromVector(kRadPerDeg * Vec3(n[0], n[1], n[2]));
}

Result<Mat3> Rotation(std::span<const double> n) {
  return FromTurn(n);
}

std::vector<double> Numbers(const Mat3& R, std::span<const double> old) {
  const Vec3 turn = kDegPerRad * VectorFromRotation(R);
  // The other way round, if that is nearer to the old numbers.
  const Vec3 before(old[0], old[1], old[2]);
  const double angle = turn.norm();
  const Vec3 other = angle > 0 ? Vec3(turn * ((angle - 360) / angle)) : turn;
  const Vec3 best = (other - before).norm() < (turn - before).norm() ? other : turn;
  return {best.x(), best.y(), best.z()};
}

std::optional<double> Value(const std::string& text) {
  double value = 0;
  const char* first = text.data() + (text.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(first, text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value)
                                                                  : std::nullopt;
}

class Reader {
 public:
  Reader(std::vector<SourceFile> files) { program_.files = std::move(files); }

  Reading Read() {
    program_.marks.resize(program_.files.size());
    for (const bool motions : {false, true}) {
      for (std::size_t f = 0; f < program_.files.size(); ++f) ReadFile(f, motions);
    }
    return {std::move(program_), {}};
  }

 private:
  void ReadFile(std::size_t f, bool motions) {
    const std::string& bytes = program_.files[f].bytes;
    int line = 0;
    routine_ = nullptr;
    for (std::size_t at = 0; at < bytes.size();) {
      const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
      ++line;
      std::vector<Word> words;
      for (std::size_t k = at; k < end;) {
        const auto blank = [&](std::size_t i) {
          return bytes[i] == ' ' || bytes[i] == '\r' || bytes[i] == '\t';
        };
        if (blank(k)) {
          ++k;
          continue;
        }
        std::size_t stop = k;
        while (stop < end && !blank(stop)) ++stop;
        words.push_back({bytes.substr(k, stop - k), {f, k, stop}});
        k = stop;
      }
      const Span statement{f, at, end};
      if (!words.empty()) ReadLine(words, {f, line}, statement, motions);
      at = end + 1;
    }
  }

  Pose PoseAt(const std::vector<Word>& words, std::size_t first) {
    std::vector<double> n;
    for (std::size_t k = first; k < first + 6 && k < words.size(); ++k) {
      n.push_back(Value(words[k].text).value_or(0));
    }
    n.resize(6, 0);
    return {FromTurn(std::span(n).subspan(3)), 1e-3 * Vec3(n[0], n[1], n[2])};
  }

  LoadValue LoadAt(const std::vector<Word>& words, std::size_t first) {
    LoadValue load;
    if (words[first].text != "-") load.mass_kg = Value(words[first].text);
    if (words.size() >= first + 4) {
      for (int k = 0; k < 3; ++k) {
        load.cog_F[k] =
            1e-3 * Value(words[first + 1 + static_cast<std::size_t>(k)].text).value_or(0);
      }
    }
    return load;
  }

  void ReadPoint(const std::vector<Word>& words, const Place& place) {
    Point point;
    point.name = words[1].text;
    point.place = place;
    point.kind = words[0].text == "joints" ? PointKind::kJoints : PointKind::kPose;
    std::size_t k = 2;
    for (; k < words.size() && k < 8; ++k) {
      const auto value = Value(words[k].text);
      point.numbers.push_back(value ? std::optional(Number{words[k].span, *value}) : std::nullopt);
    }
    for (; k < words.size(); ++k) {
      const std::string& word = words[k].text;
      if (word.starts_with("posture=")) {
        Span span = words[k].span;
        span.begin += 8;
        point.configuration.fields.push_back({"posture", span, word.substr(8)});
      } else if (word == "near") {
        while (++k < words.size()) point.near_q.push_back(kRadPerDeg * *Value(words[k].text));
      } else if (word == "untaught") {
        point.untouchable = "untaught";
      } else if (word == "accurate") {
        point.absolutely_accurate = true;
      } else if (word == "ext") {
        ++k;
        point.external_axes.push_back(Number{words[k].span, *Value(words[k].text)});
      } else if (word == "in") {
        point.stated_base = words[++k].text;
      }
    }
    index_[point.name] = program_.points.size();
    program_.points.push_back(point);
  }

  /// A point written in the motion: p:x,y,z,rx,ry,rz.
  std::size_t Literal(const Word& word, const Place& place) {
    Point point;
    point.place = place;
    for (std::size_t at = 2; at < word.text.size();) {
      const std::size_t comma = std::min(word.text.find(',', at), word.text.size());
      const Span span{word.span.file, word.span.begin + at, word.span.begin + comma};
      point.numbers.push_back(Number{span, Value(word.text.substr(at, comma - at)).value_or(0)});
      at = comma + 1;
    }
    program_.points.push_back(point);
    return program_.points.size() - 1;
  }

  Target TargetOf(const Word& whole, const Place& place) {
    const std::string& word = whole.text;
    Target target;
    if (word.starts_with("p:")) {
      target.point = Literal(whole, place);
      return target;
    }
    const auto plus = word.find('+');
    const auto at = index_.find(word.substr(0, plus));
    if (at == index_.end()) {
      target.computed = word;
      return target;
    }
    target.point = at->second;
    if (plus == std::string::npos) return target;
    const std::string offset = word.substr(plus + 1);
    if (offset == "?") {
      target.offset.unknown = "the offset is computed";
      return target;
    }
    target.offset.in = offset.starts_with("base") ? Offset::In::kBase : Offset::In::kTool;
    std::string numbers = offset.substr(offset.find(':') + 1);
    for (int k = 0; k < 3; ++k) {
      const std::size_t comma = std::min(numbers.find(','), numbers.size());
      target.offset.X.p[k] = 1e-3 * Value(numbers.substr(0, comma)).value_or(0);
      numbers.erase(0, comma + 1);
    }
    return target;
  }

  static Setting SettingOf(const std::string& word) {
    if (word == "?") return {"", "computed"};
    return {word == "none" ? "" : word, ""};
  }

  void ReadLine(const std::vector<Word>& words, const Place& place, const Span& statement,
                bool motions) {
    const std::string& word = words[0].text;
    if (word == "#") {
      const std::string text =
          program_.files[place.file].bytes.substr(statement.begin, statement.end - statement.begin);
      if (text.find("plumbline ") != std::string::npos) program_.marks[place.file] = text;
      return;
    }
    if (word == "sub") {
      if (!motions) return;
      program_.routines.push_back(
          {words[1].text, place, words.size() > 2 && words[2].text == "starts", {}});
      routine_ = &program_.routines.back();
      return;
    }
    if (word == "end") {
      routine_ = nullptr;
      return;
    }
    if (!motions) {
      if (word == "point" || word == "joints") ReadPoint(words, place);
      if (word == "tool" || word == "base") {
        FrameValue frame{place, PoseAt(words, 2), {}, {}};
        if (words.size() > 8) frame.load = LoadAt(words, 8);
        (word == "tool" ? program_.tools : program_.bases)[words[1].text] = frame;
      }
      if (word == "load") program_.loads[words[1].text] = LoadAt(words, 2);
      return;
    }
    if (routine_ == nullptr) return;
    Step step;
    step.place = place;
    static const std::map<std::string, StepKind> kKinds = {
        {"use", StepKind::kSetTool},     {"in", StepKind::kSetBase},
        {"carry", StepKind::kSetLoad},   {"grip", StepKind::kSetExtra},
        {"shift", StepKind::kShift},     {"label", StepKind::kLabel},
        {"jump", StepKind::kJump},       {"branch", StepKind::kBranch},
        {"call", StepKind::kCall},       {"return", StepKind::kReturn},
        {"wait", StepKind::kPostureLost}};
    if (const auto kind = kKinds.find(word); kind != kKinds.end()) {
      step.kind = kind->second;
      if (words.size() > 1) {
        step.label = words[1].text;
        step.setting = SettingOf(words[1].text);
      }
      if (step.kind == StepKind::kShift) {
        step.setting = {"", words[1].text == "on" ? "a displacement is active" : ""};
      }
    } else if (word == "touch" || word == "peek") {
      step.kind = StepKind::kUse;
      step.point = index_.at(words[1].text);
      if (word == "touch") step.reason = "it is copied";
    } else if (word == "J" || word == "L" || word == "C" || word == "S" || word == "search") {
      step.motion.kind = word == "J"   ? MotionKind::kJoint
                         : word == "C" ? MotionKind::kCircular
                         : word == "S" ? MotionKind::kSpline
                                       : MotionKind::kLinear;
      std::size_t k = 1;
      if (word == "C") step.motion.via = TargetOf(words[k++], place);
      step.motion.end = TargetOf(words[k], place);
      if (word == "search") step.motion.special = "a search ends where contact happens";
      step.motion.statement = statement;
    } else {
      return;
    }
    routine_->steps.push_back(std::move(step));
  }

  Program program_;
  Routine* routine_ = nullptr;
  std::map<std::string, std::size_t> index_;
};

}  // namespace

ToyBrand::ToyBrand(NumberStyle style, bool comments) : comments_(comments) {
  conventions_.length = style;
  conventions_.angle = style;
  conventions_.rotation = Rotation;
  conventions_.numbers = Numbers;
}

bool ToyBrand::Recognises(const SourceFile& file) const {
  return file.name.ends_with(".toy");
}

Reading ToyBrand::Read(std::vector<SourceFile> files) const {
  return Reader(std::move(files)).Read();
}

std::string ToyBrand::PostureText(const model::JointVector& q) {
  std::string text;
  for (const double joint : q) text += joint < 0 ? '-' : '+';
  return text;
}

bool ToyBrand::Agrees(const Configuration& stated, const kinematics::Chain&,
                      const model::JointVector& q, MotionKind kind) const {
  return stated.fields.empty() || kind == MotionKind::kLinear ||
         stated.fields.front().text == PostureText(q);
}

std::vector<std::string> ToyBrand::ConfigurationOf(const Configuration& stated,
                                                   const kinematics::Chain&,
                                                   const model::JointVector& q) const {
  return std::vector<std::string>(stated.fields.size(), PostureText(q));
}

std::optional<Brand::Insertion> ToyBrand::Mark(const SourceFile&, std::string_view mark) const {
  if (!comments_) return std::nullopt;
  return Insertion{0, fmt::format("# {}\n", mark)};
}

std::optional<std::string> ToyBrand::InsertedMotion(const Program& program, const Motion&,
                                                    std::span<const double> numbers, double) const {
  static_cast<void>(program);
  return fmt::format("L p:{:.4f}\n", fmt::join(numbers, ","));
}

}  // namespace plumbline::test
