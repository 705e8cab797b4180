#include "app/programs/brands/fanuc_backup.h"

#include <array>

#include "app/programs/brands/fanuc_positions.h"
#include "app/programs/brands/fanuc_statements.h"
#include "app/programs/brands/orientation_branches.h"
#include "app/programs/brands/source_cursor.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::programs::fanuc {
namespace {

constexpr double kMetrePerCm = 1e-2;

/// `[1,3]`: 3 of group 1; nothing for other groups.
std::optional<long> IndexOfGroup1(std::string_view content) {
  const auto comma = content.find(',');
  if (comma == std::string_view::npos || IndexIn(content.substr(0, comma)) != 1L)
    return std::nullopt;
  return IndexIn(content.substr(comma + 1));
}

/// The value after `name` and a colon in a line.
std::optional<double> ValueOf(std::string_view line, char name) {
  for (std::size_t at = 0; at + 1 < line.size(); ++at) {
    if (line[at] != name || line[at + 1] != ':' || (at > 0 && IsWordSign(line[at - 1]))) continue;
    SourceCursor cursor(line, 0, at + 2, line.size());
    cursor.SkipBlanks();
    const auto number = cursor.TakeNumber();
    return number ? std::optional(number->value) : std::nullopt;
  }
  return std::nullopt;
}

/// The three values of a line, `X:  3495.600   Y:  5813.000   Z: -1166.400`.
std::optional<Vec3> Values(std::string_view line, std::string_view names) {
  Vec3 values;
  for (int i = 0; i < 3; ++i) {
    const auto value = ValueOf(line, names[static_cast<std::size_t>(i)]);
    if (!value) return std::nullopt;
    values[i] = *value;
  }
  return values;
}

class Listing {
 public:
  Listing(std::size_t file, Program& program) : file_(file), program_(program) {}

  void Line(std::string_view line, int number) {
    const std::string_view text = TrimBlanks(line);
    if (text.starts_with("[*")) {
      frames_ = text.find("$MNUFRAME ") != std::string_view::npos  ? &program_.bases
                : text.find("$MNUTOOL ") != std::string_view::npos ? &program_.tools
                                                                   : nullptr;
      index_.reset();
      position_.reset();
    } else if (frames_ != nullptr && text.starts_with('[')) {
      index_ = IndexOfGroup1(BracketedAt(text, 0).content);
      position_.reset();
    } else if (frames_ != nullptr && index_) {
      Frame(text, number);
    } else if (text.starts_with("Field: $PLST_GRP1[")) {
      Payload(text);
    }
  }

 private:
  void Frame(std::string_view text, int number) {
    if (const auto position = Values(text, "XYZ")) position_ = *position * kMetrePerMm;
    const auto angles = Values(text, "WPR");
    if (!angles || !position_) return;
    const auto R = RotationFromRpyDegrees(std::array{(*angles)[0], (*angles)[1], (*angles)[2]});
    if (!R) return;
    FrameValue value;
    value.place = {file_, number};
    value.X = {*R, *position_};
    (*frames_)[frames_ == &program_.tools ? ToolKey(*index_) : BaseKey(*index_)] = value;
    index_.reset();
  }

  void Payload(std::string_view text) {
    const auto open = text.find('[');
    const Bracketed index = BracketedAt(text, open);
    const auto schedule = IndexIn(index.content);
    if (!schedule || text.substr(index.after, 2) != ".$") return;
    SourceCursor at(text, 0, index.after + 2, text.size());
    const std::string_view field = at.TakeWord();
    const auto equals = text.rfind('=');
    if (!field.starts_with("PAYLOAD") || equals == std::string_view::npos) return;
    at.MoveTo(equals + 1);
    at.SkipBlanks();
    const auto number = at.TakeNumber();
    if (!number) return;
    LoadValue& load = program_.loads[LoadKey(*schedule)];
    if (field == "PAYLOAD" && number->value >= 0) load.mass_kg = number->value;
    if (field == "PAYLOAD_X") load.cog_F.x() = number->value * kMetrePerCm;
    if (field == "PAYLOAD_Y") load.cog_F.y() = number->value * kMetrePerCm;
    if (field == "PAYLOAD_Z") load.cog_F.z() = number->value * kMetrePerCm;
  }

  std::size_t file_;
  Program& program_;
  std::map<std::string, FrameValue>* frames_ = nullptr;
  std::optional<long> index_;
  std::optional<Vec3> position_;
};

}  // namespace

bool IsVariableListing(std::string_view bytes) {
  return bytes.starts_with("[*SYSTEM*]$");
}

void ReadVariableListing(std::size_t file, Program& program) {
  const LineIndex lines(program.files[file].bytes);
  Listing listing(file, program);
  for (int line = 1; line <= lines.count(); ++line) listing.Line(lines.Text(line), line);
}

}  // namespace plumbline::programs::fanuc
