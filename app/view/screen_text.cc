#include "app/view/screen_text.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <span>

#include "app/view/panels.h"
#include "app/view/silent_daemon.h"
#include "drivers/display/colour_scale.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::view {
namespace {

constexpr scene::Colour kPaper{0.07F, 0.08F, 0.10F, 1}, kBar{0.12F, 0.13F, 0.16F, 1},
    kShadow{0.05F, 0.05F, 0.06F, 0.75F}, kStale{1.0F, 0.66F, 0.0F, 1},
    kTitle{0.55F, 0.72F, 0.95F, 1};
constexpr float kGap_em = 0.3F;            ///< between the images of two cameras
constexpr std::size_t kMaxUrgentRows = 5;  ///< of one panel, served before other panels' second row

scene::Colour ColourOf(Tone tone) {
  switch (tone) {
    case Tone::kPlain:
      return {0.92F, 0.92F, 0.92F, 1};
    case Tone::kGood:
      return {0.45F, 0.90F, 0.50F, 1};
    case Tone::kAttention:
      return {1.0F, 0.75F, 0.20F, 1};
    case Tone::kBad:
      return {1.0F, 0.45F, 0.40F, 1};
    case Tone::kFaded:
      return {0.62F, 0.64F, 0.68F, 1};
  }
  return {};
}

class Writer {
 public:
  Writer(const PictureLayout& layout, const TextWidth& text_width, scene::DisplayList& list)
      : layout_(layout), text_width_(text_width), list_(list) {}

  void Box(const scene::Area& area, const scene::Colour& colour) {
    list_.boxes.push_back({area.x, area.y, area.width, area.height, colour});
  }
  /// One line; `y` is its upper edge. Capitals are centred vertically.
  void Line(float x, float y, float width, const std::string& text, const scene::Colour& colour) {
    const std::string fitted = Elided(text, layout_.em, width, text_width_);
    if (fitted.empty()) return;
    list_.texts.push_back({x, y + layout_.em, layout_.em, colour, fitted});
  }
  float WidthOf(const std::string& text) const { return text_width_(text, layout_.em); }
  std::vector<std::string> Rows(const std::string& text, float width) const {
    return Wrapped(text, layout_.em, width, text_width_);
  }

 private:
  const PictureLayout& layout_;
  const TextWidth& text_width_;
  scene::DisplayList& list_;
};

/// A line of a panel, or one piece of an urgent line that was wrapped.
struct Row {
  std::string text;
  std::string rest;  ///< from here to the end of the line: shown if the next piece has no room
  Tone tone;
  bool starts_line;
};
using Rows = std::vector<Row>;

/// Whether the operator should act on it.
bool IsUrgent(Tone tone) {
  return tone == Tone::kBad || tone == Tone::kAttention;
}

Rows RowsOf(const Panel& panel, float width, const Writer& writer) {
  Rows rows;
  for (const PanelLine& line : panel.lines) {
    if (!IsUrgent(line.tone)) {  // may be truncated: leaves room for other lines
      rows.push_back({line.text, line.text, line.tone, true});
      continue;
    }
    std::string rest = line.text;
    for (const std::string& piece : writer.Rows(line.text, width)) {
      rows.push_back({piece, rest, line.tone, rest.size() == line.text.size()});
      rest.erase(0, piece.size() + 1);
    }
  }
  return rows;
}

/// Number of rows up to the last urgent one.
std::size_t UrgentRows(const Rows& rows) {
  std::size_t urgent = 0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (IsUrgent(rows[k].tone)) urgent = k + 1;
  }
  return std::min(urgent, kMaxUrgentRows);
}

/// Number of rows for each panel, title excluded: one each, then the urgent rows, first panel
/// first, then one at a time for each panel in turn.
std::vector<std::size_t> ShareRows(const std::vector<Rows>& panels, std::size_t room) {
  std::vector<std::size_t> given(panels.size(), 0);
  std::size_t left = room > panels.size() ? room - panels.size() : 0;
  const auto give = [&](std::size_t k, std::size_t rows) {
    while (left > 0 && given[k] < std::min(rows, panels[k].size())) {
      ++given[k];
      --left;
    }
  };
  for (std::size_t k = 0; k < panels.size(); ++k) give(k, 1);
  for (std::size_t k = 0; k < panels.size(); ++k) give(k, UrgentRows(panels[k]));
  for (std::size_t before = left + 1; left < before;) {
    before = left;
    for (std::size_t k = 0; k < panels.size(); ++k) give(k, given[k] + 1);
  }
  return given;
}

void AddColumn(const std::vector<Panel>& panels, const PictureLayout& layout, Writer& writer) {
  const scene::Area& column = layout.column;
  writer.Box(column, kPaper);
  const float margin = 0.5F * layout.em, width = column.width - 2 * margin;
  const auto room =
      static_cast<std::size_t>(std::max(0.0F, (column.height - margin) / layout.line()));
  std::vector<Rows> rows;
  rows.reserve(panels.size());
  for (const Panel& panel : panels) rows.push_back(RowsOf(panel, width - margin, writer));
  const std::vector<std::size_t> given = ShareRows(rows, room);
  float y = column.y + margin / 2;
  for (std::size_t k = 0; k < panels.size(); ++k) {
    if (y + layout.line() > column.bottom()) return;
    const std::span<const Row> shown = std::span(rows[k]).first(given[k]);
    const std::span<const Row> not_shown = std::span(rows[k]).subspan(given[k]);
    const auto hidden = std::count_if(not_shown.begin(), not_shown.end(),
                                      [](const Row& row) { return row.starts_line; });
    const std::string& name = panels[k].title;
    const std::string title = hidden > 0 ? fmt::format("{} (+{})", name, hidden) : name;
    writer.Line(column.x + margin, y, width, title, kTitle);
    y += layout.line();
    const bool cut = !not_shown.empty() && !not_shown.front().starts_line;
    for (std::size_t i = 0; i < shown.size() && y + layout.line() <= column.bottom(); ++i) {
      const Row& row = shown[i];
      writer.Line(column.x + 2 * margin, y, width - margin,
                  cut && i + 1 == shown.size() ? row.rest : row.text, ColourOf(row.tone));
      y += layout.line();
    }
  }
}

std::string ClockText(double utc_s) {
  if (!(utc_s >= 0 && utc_s < 253402300800.0)) return "";
  return fmt::format("{:%Y-%m-%d %H:%M:%S} UTC", fmt::gmtime(static_cast<std::time_t>(utc_s)));
}

void AddBar(const ViewFacts& facts, const PictureLayout& layout, Writer& writer) {
  writer.Box(layout.top, kBar);
  const float margin = 0.5F * layout.em, y = layout.top.y + (layout.top.height - layout.line()) / 2;
  std::string right;
  if (facts.state != nullptr) {
    right = fmt::format("{}   {}", facts.state->cell, ClockText(facts.state->utc_s));
  }
  const float most = 0.5F * layout.top.width;
  const float width = std::min(most, writer.WidthOf(right) + 1);
  writer.Line(layout.top.right() - margin - width, y, width, right, ColourOf(Tone::kPlain));
  const PanelLine headline = Headline(facts);
  writer.Line(layout.top.x + margin, y, layout.top.width - width - 4 * margin, headline.text,
              ColourOf(headline.tone));
}

void AddMessages(const ViewFacts& facts, const PictureLayout& layout, Writer& writer) {
  writer.Box(layout.messages, kBar);
  const float margin = 0.3F * layout.em;
  const auto rows =
      static_cast<std::size_t>((layout.messages.height - 2 * margin) / layout.line() + 0.05F);
  float y = layout.messages.y + margin;
  for (const PanelLine& message : RecentMessages(facts, rows)) {
    writer.Line(layout.messages.x + 0.5F * layout.em, y, layout.messages.width - layout.em,
                message.text, ColourOf(message.tone));
    y += layout.line();
  }
}

bool Overlap(const scene::Area& a, const scene::Area& b) {
  return a.x < b.right() && b.x < a.right() && a.y < b.bottom() && b.y < a.bottom();
}

/// Texts over the image that do not overlap.
class Annotations {
 public:
  Annotations(const PictureLayout& layout, Writer& writer)
      : layout_(layout), image_(layout.image), writer_(writer) {}

  /// @return  false if there was no room
  bool Write(float x, float y, const std::string& text, const scene::Colour& colour) {
    const float pad = 0.3F * layout_.em;
    const float width = std::min(writer_.WidthOf(text) + 1 + 2 * pad, image_.width);
    scene::Area area{std::clamp(x, image_.x, image_.right() - width), y, width, layout_.line()};
    if (area.y < image_.y) area.y = image_.y;
    for (int moves = 0; moves < 100; ++moves) {
      const auto other = std::find_if(taken_.begin(), taken_.end(),
                                      [&](const scene::Area& one) { return Overlap(area, one); });
      if (other == taken_.end()) break;
      area.y = other->bottom();
    }
    if (area.bottom() > image_.bottom()) return false;
    Reserve(area);
    writer_.Box(area, kShadow);
    writer_.Line(area.x + pad, area.y, area.width - 2 * pad, text, colour);
    return true;
  }
  void Reserve(const scene::Area& area) { taken_.push_back(area); }

 private:
  const PictureLayout& layout_;
  const scene::Area image_;
  Writer& writer_;
  std::vector<scene::Area> taken_;
};

void AddFrame(const scene::Area& area, float width, const scene::Colour& colour, Writer& writer) {
  writer.Box({area.x, area.y, area.width, width}, colour);
  writer.Box({area.x, area.bottom() - width, area.width, width}, colour);
  writer.Box({area.x, area.y + width, width, area.height - 2 * width}, colour);
  writer.Box({area.right() - width, area.y + width, width, area.height - 2 * width}, colour);
}

void AddStressScale(const OverlayInput& input, const PictureLayout& layout,
                    Annotations& annotations, Writer& writer) {
  const Carriers& carriers = input.facts.carriers.front();  // all cameras have the same tool
  if (!input.config.stress || !carriers.tool) return;
  constexpr int kSteps = 24;
  const scene::Area& image = layout.image;
  const float width = 12 * layout.em / kSteps, y = image.bottom() - 2.6F * layout.line();
  const float x = image.x + 0.6F * layout.em;
  for (int k = 0; k < kSteps; ++k) {
    writer.Box({x + static_cast<float>(k) * width, y, width, 0.8F * layout.line()},
               display::StressColour((k + 0.5) / kSteps));
  }
  annotations.Reserve({x, y, kSteps * width, layout.line()});
  float largest_Pa = 0;
  for (const scene::BendStation& station : carriers.tool->bend.stations) {
    largest_Pa = std::max(largest_Pa, station.stress_Pa);
  }
  annotations.Write(
      x, y + layout.line(),
      fmt::format("stress 0..{:.0f} MPa, maximum now {:.1f} MPa", input.config.stress_full_Pa / 1e6,
                  static_cast<double>(largest_Pa) / 1e6),
      ColourOf(Tone::kPlain));
}

}  // namespace

void AddPanels(const ViewFacts& facts, const PictureLayout& layout, const TextWidth& text_width,
               scene::DisplayList& list) {
  Writer writer(layout, text_width, list);
  AddBar(facts, layout, writer);
  AddColumn(PanelsOf(facts), layout, writer);
  AddMessages(facts, layout, writer);
}

void AddAnnotations(const OverlayInput& input, std::size_t k, const PictureLayout& layout,
                    const std::vector<Label>& labels, const TextWidth& text_width,
                    scene::DisplayList& list) {
  Writer writer(layout, text_width, list);
  Annotations annotations(layout, writer);
  const scene::Area& image = layout.image;
  const float inset = 0.6F * layout.em;
  const view_link::ViewState& state = *input.facts.state;
  const status::CameraStatus& status = view_link::CameraOf(state, k).status;
  if (status.name != status::CameraName::kNone) {
    annotations.Write(image.x + inset, image.y + inset, status::CameraNameText(status.name),
                      kTitle);
  }
  const auto reasons = StaleReasons(input.facts, std::span(&k, 1));
  if (!reasons.empty()) {
    AddFrame(image, std::max(3.0F, 0.25F * layout.em), kStale, writer);
    for (const std::string& reason : reasons) {
      annotations.Write(image.x + inset, image.y + inset, "STALE: " + reason, kStale);
    }
  }
  const CellHealth health = DisplayedHealth(input.facts);
  if (health.severity == HealthSeverity::kAlarm) {
    annotations.Write(image.x + inset, image.y + inset, std::string("→ ") + RemedyOf(health.reason),
                      ColourOf(Tone::kBad));
  }
  if (state.cameras.empty()) {
    annotations.Write(image.x + inset, image.y + inset, "no camera is configured",
                      ColourOf(Tone::kFaded));
  }
  if (input.config.exaggeration != 1) {
    annotations.Write(image.x + inset, image.y + inset,
                      fmt::format("deflection exaggerated {:g} times", input.config.exaggeration),
                      kStale);
  }
  if (status.prompt != lens::BoardPrompt::kNone) {
    annotations.Write(
        image.x + inset, image.y + inset,
        fmt::format("→ {} ({} views)", lens::BoardPromptText(status.prompt), status.board_views),
        kStale);
  }
  AddStressScale(input, layout, annotations, writer);
  for (const Label& label : labels) {
    const bool inside = label.x >= image.x && label.x < image.right() && label.y >= image.y &&
                        label.y < image.bottom();
    if (inside) annotations.Write(label.x + inset, label.y + inset, label.text, label.colour);
  }
}

namespace {

scene::DisplayList PictureOfState(const OverlayInput& input, const PictureLayout& layout,
                                  const TextWidth& text_width) {
  scene::DisplayList list;
  const std::vector<std::size_t>& shown = input.facts.shown;
  const auto& first = view_link::CameraOf(*input.facts.state, shown.front()).image;
  const image::ImageSize size =
      first ? image::ImageSize{first->width, first->height} : image::ImageSize{1920, 1080};
  const std::vector<scene::Area> parts =
      SplitArea(layout.image, shown.size(), size, kGap_em * layout.em);
  for (std::size_t i = 0; i < shown.size(); ++i) {
    PictureLayout part = layout;
    part.image = parts[i];
    scene::DisplayList& view = i == 0 ? list : list.beside.emplace_back();
    if (shown.size() > 1) view.area = part.image;
    std::vector<Label> labels;
    AddOverlay(input, shown[i], part, view, labels);
    AddAnnotations(input, shown[i], part, labels, text_width, list);
  }
  AddPanels(input.facts, layout, text_width, list);
  return list;
}

}  // namespace

scene::DisplayList PictureOf(const OverlayInput& input, const PictureLayout& layout,
                             const TextWidth& text_width) {
  const ViewFacts& facts = input.facts;
  if (const auto withdrawn = WithdrawnState(*facts.state, facts.link_problem, facts.now_s)) {
    ViewFacts silent = facts;
    silent.state = &*withdrawn;
    return PictureOfState({silent, input.config, input.meshes, input.pixels}, layout, text_width);
  }
  return PictureOfState(input, layout, text_width);
}

scene::DisplayList PictureWithoutState(const ViewFacts& facts, const PictureLayout& layout,
                                       const TextWidth& text_width) {
  scene::DisplayList list;
  list.size = layout.size;
  list.pinhole = PinholeIn(layout.image, PlainLens({1920, 1080}), {1920, 1080});
  AddPanels(facts, layout, text_width, list);
  return list;
}

}  // namespace plumbline::view
