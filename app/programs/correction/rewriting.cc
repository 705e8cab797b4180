#include "app/programs/correction/rewriting.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <nlohmann/json.hpp>
#include <sstream>
#include <tuple>

#include "app/base/text/json_text.h"
#include "app/base/text/sha256.h"
#include "app/base/text/text.h"
#include "app/programs/correction/point_text.h"

namespace plumbline::programs {
namespace {

constexpr std::size_t kDigits = 12;

/// The spans of all numbers and configurations of a file's points, in the order of the file.
std::vector<Span> SpansOf(const Program& program, std::size_t file) {
  std::vector<Span> spans;
  const auto add = [&](const Span& span) {
    const bool usable =
        span.file == file && span.begin < span.end && span.end <= program.files[file].bytes.size();
    if (usable) spans.push_back(span);
  };
  for (const Point& point : program.points) {
    for (const auto& number : point.numbers) {
      if (number) add(number->span);
    }
    for (const Configuration::Field& field : point.configuration.fields) add(field.span);
  }
  std::sort(spans.begin(), spans.end(),
            [](const Span& a, const Span& b) { return a.begin < b.begin; });
  return spans;
}

std::string TextAt(const Program& program, const Span& span) {
  return program.files[span.file].bytes.substr(span.begin, span.end - span.begin);
}

std::vector<Edit> AllEdits(const ProgramCorrection& correction) {
  std::vector<Edit> edits = correction.insertions;
  for (const PointCorrection& point : correction.points) {
    if (!point.reason.empty()) continue;
    edits.insert(edits.end(), point.edits.begin(), point.edits.end());
  }
  return edits;
}

bool Overlap(std::vector<Edit> edits) {
  std::sort(edits.begin(), edits.end(), [](const Edit& a, const Edit& b) {
    return std::tuple(a.file, a.begin, a.end) < std::tuple(b.file, b.begin, b.end);
  });
  for (std::size_t k = 1; k < edits.size(); ++k) {
    if (edits[k].file == edits[k - 1].file && edits[k].begin < edits[k - 1].end) return true;
  }
  return false;
}

}  // namespace

std::vector<SourceFile> WithEdits(const std::vector<SourceFile>& files, std::vector<Edit> edits) {
  std::stable_sort(edits.begin(), edits.end(), [](const Edit& a, const Edit& b) {
    return a.file != b.file ? a.file < b.file : a.begin < b.begin;
  });
  std::vector<SourceFile> edited;
  std::size_t next = 0;
  for (std::size_t f = 0; f < files.size(); ++f) {
    const std::string& bytes = files[f].bytes;
    SourceFile& file = edited.emplace_back(SourceFile{files[f].name, {}});
    std::size_t at = 0;
    for (; next < edits.size() && edits[next].file == f; ++next) {
      const Edit& edit = edits[next];
      assert(edit.begin >= at && edit.end >= edit.begin && edit.end <= bytes.size());
      file.bytes.append(bytes, at, edit.begin - at);
      file.bytes += edit.text;
      at = edit.end;
    }
    file.bytes.append(bytes, at);
  }
  return edited;
}

std::string ShortDigest(std::string_view bytes) {
  return text::Sha256Hex(bytes).substr(0, kDigits);
}

std::string MarkText(const Mark& mark) {
  return fmt::format("plumbline {} {} model {} numbers {}", mark.version, mark.date, mark.model,
                     mark.numbers);
}

std::optional<Mark> MarkFrom(std::string_view text) {
  const auto start = text.find("plumbline ");
  if (start == std::string_view::npos) return std::nullopt;
  std::istringstream words{std::string(text.substr(start))};
  Mark mark;
  std::string product, model, numbers;
  words >> product >> mark.version >> mark.date >> model >> mark.model >> numbers >> mark.numbers;
  const bool hex = mark.numbers.size() >= kDigits &&
                   mark.numbers.find_first_not_of("0123456789abcdef") >= kDigits;
  if (!words || model != "model" || numbers != "numbers" || !hex) return std::nullopt;
  mark.numbers.resize(kDigits);  // a comment may be closed without a blank
  return mark;
}

std::string NumbersDigest(const Program& program, std::size_t file) {
  std::string all;
  for (const Span& span : SpansOf(program, file)) all += TextAt(program, span) + '\n';
  return ShortDigest(all);
}

FileState StateOf(const Program& program, std::size_t file, std::string_view record) {
  const std::string numbers = NumbersDigest(program, file);
  if (file < program.marks.size()) {
    if (const auto mark = MarkFrom(program.marks[file])) {
      return mark->numbers == numbers ? FileState::kCorrected : FileState::kEdited;
    }
  }
  const nlohmann::json json = text::JsonOrNull(record);
  if (!json.is_object() || !json.contains("numbers") || !json["numbers"].is_string()) {
    return FileState::kOriginal;
  }
  const std::string recorded = json["numbers"].get<std::string>();
  if (recorded == numbers) return FileState::kCorrected;
  // A record beside a file that was never corrected: the taught numbers.
  const bool taught = json.contains("taught_numbers") && json["taught_numbers"] == numbers;
  return taught ? FileState::kOriginal : FileState::kEdited;
}

nlohmann::json RecordOf(const Program& program, std::size_t file,
                        const ProgramCorrection& correction, const Mark& mark,
                        const std::string& original_path, const std::string& corrected_bytes) {
  nlohmann::json points = nlohmann::json::array();
  for (const PointCorrection& point : correction.points) {
    const Point& source = program.points[point.point];
    if (!point.reason.empty() || source.place.file != file || point.edits.empty()) continue;
    nlohmann::json taught = nlohmann::json::array(), corrected = nlohmann::json::array();
    const auto add = [&](const Span& span) {
      const auto edit = std::ranges::find_if(point.edits, [&](const Edit& one) {
        return one.file == span.file && one.end == span.end;
      });
      const std::string old = TextAt(program, span);
      taught.push_back(text::Visible(old));
      corrected.push_back(edit == point.edits.end() ? text::Visible(old)
                                                    : text::Visible(TrimmedBlanks(edit->text)));
    };
    for (const auto& number : source.numbers) {
      if (number) add(number->span);
    }
    for (const Configuration::Field& field : source.configuration.fields) add(field.span);
    points.push_back({{"name", text::Visible(source.name)},
                      {"line", source.place.line},
                      {"taught", taught},
                      {"corrected", corrected}});
  }
  return {{"schema", 1},
          {"plumbline", mark.version},
          {"date", mark.date},
          {"model", mark.model},
          {"original", text::Visible(original_path)},
          {"original_sha256", text::Sha256Hex(program.files[file].bytes)},
          {"corrected_sha256", text::Sha256Hex(corrected_bytes)},
          {"taught_numbers", NumbersDigest(program, file)},
          {"numbers", mark.numbers},
          {"points", points}};
}

std::optional<RecordedOriginal> OriginalFrom(std::string_view record) {
  const nlohmann::json json = text::JsonOrNull(record);
  const auto text = [&](const char* key) -> std::string {
    return json.is_object() && json.contains(key) && json[key].is_string()
               ? json[key].get<std::string>()
               : std::string();
  };
  RecordedOriginal original{text("original"), text("original_sha256")};
  if (original.path.empty() || original.sha256.empty()) return std::nullopt;
  return original;
}

Result<Rewritten> Rewrite(const Brand& brand, const Program& program,
                          const ProgramCorrection& correction, const Mark& mark) {
  const auto defect = [](const std::string& what) {
    return Error{what +
                 "; nothing is written. This is a defect: please report it with the program"};
  };
  const std::vector<Edit> edits = AllEdits(correction);
  if (Overlap(edits)) return defect("two points share a number");
  Rewritten rewritten;
  rewritten.files = WithEdits(program.files, edits);
  rewritten.changed.assign(program.files.size(), false);
  for (const Edit& edit : edits) rewritten.changed[edit.file] = true;
  rewritten.marks.assign(program.files.size(), mark);
  const Program read = brand.Read(rewritten.files).program;
  if (correction.insertions.empty()) {
    if (read.points.size() != program.points.size()) {
      return defect("the corrected program reads with another number of points");
    }
    for (const PointCorrection& point : correction.points) {
      if (!point.reason.empty()) continue;
      const Result<Pose> pose =
          program.points[point.point].kind == PointKind::kPose
              ? PoseOf(read.points[point.point], brand.conventions(), point.corrected.R)
              : Result<Pose>(point.corrected);
      if (!pose || (pose->p - point.corrected.p).norm() > 1e-9) {
        return defect("a corrected point reads differently from what was written, " +
                      PlaceText(program, program.points[point.point].place));
      }
    }
  }
  for (std::size_t f = 0; f < rewritten.files.size(); ++f) {
    rewritten.marks[f].numbers = NumbersDigest(read, f);
    if (!rewritten.changed[f]) continue;
    SourceFile& file = rewritten.files[f];
    const auto insertion = brand.Mark(file, MarkText(rewritten.marks[f]));
    if (!insertion) continue;
    if (insertion->at > file.bytes.size()) return defect("the mark would be outside the file");
    file.bytes.insert(insertion->at, insertion->text);
  }
  const Program marked = brand.Read(rewritten.files).program;
  for (std::size_t f = 0; f < rewritten.files.size(); ++f) {
    if (rewritten.changed[f] && NumbersDigest(marked, f) != rewritten.marks[f].numbers) {
      return defect("the mark changes how the points are read");
    }
  }
  return rewritten;
}

}  // namespace plumbline::programs
