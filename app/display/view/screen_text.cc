#include "app/display/view/screen_text.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <span>

#include "app/display/view/board_guide.h"
#include "app/display/view/palette.h"
#include "app/display/view/panels.h"
#include "app/display/view/point_tiles.h"
#include "app/display/view/status_text.h"
#include "app/display/view/tip_inset.h"
#include "drivers/display/colour_scale.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::display {
namespace {

constexpr int kSteps = 48;
constexpr float kWidth_em = 13;
constexpr double kPaPerMPa = 1e6;

double LargestStress_MPa(const cell::ToolState& tool) {
  float largest_Pa = 0;
  for (const scene::BendStation& station : tool.bend.stations)
    largest_Pa = std::max(largest_Pa, station.stress_Pa);
  return static_cast<double>(largest_Pa) / kPaPerMPa;
}

}  // namespace

std::vector<double> ScaleTicks(double full) {
  double step = RoundedDown125(full / 3.5);
  if (full / step > 7.5) step = RoundedDown125(2.5 * step);
  std::vector<double> ticks;
  for (int k = 0; k * step <= full * 1.0001; ++k) ticks.push_back(k * step);
  return ticks;
}

void AddStressScale(const OverlayInput& input, LabelPlacer& placer, PictureWriter& writer) {
  const cell::Carriers& carriers = input.facts.carriers.front();  // all cameras have the same tool
  const double full = input.config.stress_full_Pa / kPaPerMPa;
  if (!input.config.stress || !carriers.tool || carriers.robot_stale || !(full > 0)) return;
  const float em = writer.layout().em, line = writer.layout().line(), pad = 0.5F * em;
  const float ends = 1.2F * em;  // the first and last number are centred on the bar's ends
  const scene::Area area = placer.TakeCorner(
      kWidth_em * em + 2 * (pad + ends), 3.3F * line,
      {Corner::kBottomLeft, Corner::kTopLeft, Corner::kTopRight, Corner::kBottomRight});
  writer.Box(area, palette::kShadow);
  const float x = area.x + pad + ends, y = area.y + 1.35F * line, height = 0.6F * line;
  const float step = kWidth_em * em / kSteps;
  for (int k = 0; k < kSteps; ++k) {
    writer.Box({x + static_cast<float>(k) * step, y, step, height},
               display::StressColour((k + 0.5) / kSteps));
  }
  const auto at = [&](double MPa) {
    return x + static_cast<float>(std::clamp(MPa / full, 0.0, 1.0)) * kWidth_em * em;
  };
  const float thin = std::max(1.5F, 0.07F * em), y_tick = y + height;
  for (const double tick : ScaleTicks(full)) {
    writer.Stroke({{at(tick), y_tick}, {at(tick), y_tick + 0.3F * em}}, palette::kText, thin);
    const std::string number = fmt::format("{:g}", tick);
    const float width = writer.WidthOf(number, em) + 1;
    writer.Text(at(tick) - width / 2, y_tick + 0.25F * em, width, em, number, palette::kText);
  }
  const double largest = LargestStress_MPa(*carriers.tool);
  const float mark = at(largest), up = 0.35F * em;
  writer.Stroke({{mark - up, y - up}, {mark, y}, {mark + up, y - up}}, palette::kText, 2 * thin);
  const PanelLine title =
      largest > full
          ? PanelLine{fmt::format("stress {:.1f} MPa: off scale", largest), Tone::kAttention}
          : PanelLine{fmt::format("stress, at most {:.1f} MPa", largest), Tone::kPlain};
  writer.Line(area.x + pad, area.y, area.width - 2 * pad, title);
}

namespace {

// Band of details below the images: camera, distances, robot and model, messages.

constexpr float kOneRow_em = 72;  ///< width from which all cells are side by side
constexpr std::size_t kMostMessages = 40;

/// Whether the operator should act on it.
bool IsUrgent(const PanelLine& line) {
  return line.tone == Tone::kBad || line.tone == Tone::kAttention;
}

/// One row of a cell. @see RowsOf
struct Row {
  PanelLine line;
  std::string rest;  ///< from here to the end of the line: shown if the next row has no room
  bool starts_line;
};

/// "long name of a pair: 12.3 mm" shortened before its value, so that the value stays.
std::string ShortenedBeforeValue(const std::string& text, float width,
                                 const PictureWriter& writer) {
  constexpr float kMostForValue = 0.6F;
  const float em = writer.layout().em;
  const std::size_t colon = text.rfind(": ");
  if (colon == std::string::npos || writer.WidthOf(text, em) <= width) return text;
  const std::string value = text.substr(colon);
  const float value_width = writer.WidthOf(value, em);
  if (value_width > kMostForValue * width) return text;
  return writer.Shortened(text.substr(0, colon), em, width - value_width) + value;
}

std::vector<Row> RowsOf(const PanelLine& line, bool wrapped, float width,
                        const PictureWriter& writer) {
  if (!wrapped && !IsUrgent(line)) {
    const std::string text = ShortenedBeforeValue(line.text, width, writer);
    return {{{text, line.tone}, text, true}};
  }
  std::vector<Row> rows;
  std::string rest = MarkedText(line);
  for (const std::string& piece : writer.Rows(rest, writer.layout().em, width)) {
    rows.push_back({{piece, line.tone}, rest, rows.empty()});
    rest.erase(0, std::min(rest.size(), piece.size() + 1));
  }
  return rows;
}

enum class CellKind { kFacts, kMessages };

/// Messages keep their order, are all wrapped, and are not counted.
void AddCell(const Panel& panel, CellKind kind, const scene::Area& area, PictureWriter& writer) {
  const bool facts = kind == CellKind::kFacts;
  const PictureLayout& layout = writer.layout();
  writer.Box(area, palette::kPanel);
  const float margin = 0.5F * layout.em, x = area.x + margin, width = area.width - 2 * margin;
  std::vector<PanelLine> lines = panel.lines;
  if (facts) std::stable_partition(lines.begin(), lines.end(), IsUrgent);
  std::vector<Row> rows;
  for (const PanelLine& line : lines) {
    for (Row& row : RowsOf(line, !facts, width, writer)) rows.push_back(std::move(row));
  }
  const auto room = static_cast<std::size_t>(
      std::max(0.0F, (area.height - 0.3F * layout.em) / layout.line() - 1 + 0.02F));
  const std::size_t shown = std::min(room, rows.size());
  const auto hidden = std::count_if(rows.begin() + static_cast<std::ptrdiff_t>(shown), rows.end(),
                                    [](const Row& row) { return row.starts_line; });
  float y = area.y + 0.2F * layout.em;
  writer.Text(x, y, width, layout.em,
              facts && hidden > 0 ? fmt::format("{} ({} more)", panel.title, hidden) : panel.title,
              palette::kFaded);
  for (std::size_t k = 0; k < shown; ++k) {
    y += layout.line();
    const bool cut = k + 1 == shown && shown < rows.size() && !rows[shown].starts_line;
    writer.Text(x, y, width, layout.em, cut ? rows[k].rest : rows[k].line.text,
                palette::OfTone(rows[k].line.tone));
  }
}

/// Adds the band. In each cell urgent lines come first and are wrapped; its title states how many
/// lines are hidden. Messages come newest first.
void AddDetailBand(const ViewFacts& facts, PictureWriter& writer) {
  const PictureLayout& layout = writer.layout();
  const scene::Area& band = layout.band;
  if (band.height < layout.line()) return;
  writer.Box(band, palette::kGround);
  std::vector<Panel> panels = WallPanelsOf(facts);
  panels.push_back({"Messages, newest first (local time)", RecentMessages(facts, kMostMessages)});
  const std::size_t messages = panels.size() - 1;
  const bool one_row = band.width >= kOneRow_em * layout.em;
  const std::size_t columns = one_row ? panels.size() : (panels.size() + 1) / 2;
  const std::size_t rows = (panels.size() + columns - 1) / columns;
  const float gap = std::round(0.25F * layout.em);
  // The messages are half as wide again as the other cells if they are beside them.
  const float parts = static_cast<float>(columns) + (one_row ? 0.5F : 0.0F);
  const float part = (band.width - gap) / parts;
  const float height = (band.height - gap) / static_cast<float>(rows);
  for (std::size_t k = 0; k < panels.size(); ++k) {
    const auto column = static_cast<float>(k % columns), row = static_cast<float>(k / columns);
    const float wide = one_row && k == messages ? 1.5F : 1.0F;
    AddCell(panels[k], k == messages ? CellKind::kMessages : CellKind::kFacts,
            {band.x + gap + column * part, band.y + gap + row * height, wide * part - gap,
             height - gap},
            writer);
  }
}

constexpr float kImageGap_em = 0.3F;

/// Of the first displayed camera; without an image, as most cameras have.
image::ImageSize ImageSizeOf(const ViewFacts& facts) {
  if (facts.state != nullptr && !facts.shown.empty()) {
    const auto& image = cell::CameraOf(*facts.state, facts.shown.front()).image;
    if (image && image->width > 0 && image->height > 0) return {image->width, image->height};
  }
  return {1920, 1080};
}

/// Local time and UTC. Without seconds: the picture of a still cell does not change.
std::string ClockText(double utc_s) {
  if (!(utc_s >= 0 && utc_s < 253402300800.0)) return "";
  const auto at = static_cast<std::time_t>(utc_s);
  const std::tm local = fmt::localtime(at);
  const std::string date = fmt::format("{:%Y-%m-%d %H:%M}", local);
  return local.tm_gmtoff == 0 ? date + " UTC"
                              : fmt::format("{} ({:%H:%M} UTC)", date, fmt::gmtime(at));
}

/// Cell and clock at the right end, two lines. @return  their width with a margin [px]
float AddCellAndClock(const ViewFacts& facts, const scene::Colour& ink, PictureWriter& writer) {
  if (facts.state == nullptr) return 0;
  const PictureLayout& layout = writer.layout();
  const float margin = 0.6F * layout.em, most = 0.3F * layout.strip.width;
  const std::string clock = ClockText(facts.state->utc_s);
  const float width = std::min(most, 1 + std::max(writer.WidthOf(facts.state->cell, layout.em),
                                                  writer.WidthOf(clock, layout.em)));
  const float right = layout.strip.right() - margin;
  const float y = layout.strip.y + layout.strip.height / 2 - layout.line();
  writer.TextAtRight(right, y, width, layout.em, facts.state->cell, ink);
  writer.TextAtRight(right, y + layout.line(), width, layout.em, clock, ink);
  return width + 2 * margin;
}

/// The reason with the remedy below it, or the remedy alone if there is room for one of them;
/// what is alone and long takes two rows.
void AddReason(const StateStrip& strip, const scene::Area& area, const scene::Colour& ink,
               PictureWriter& writer) {
  const PictureLayout& layout = writer.layout();
  const float reason_em = writer.FittingEm(strip.reason, layout.name_em, area.width);
  const bool remedy = !strip.remedy.empty() && 1.2F * (reason_em + layout.em) <= area.height;
  const bool alone = !strip.remedy.empty() && !remedy;
  const std::string first = alone ? "→ " + strip.remedy : strip.reason;
  const float em = alone ? writer.FittingEm(first, layout.name_em, area.width) : reason_em;
  const float middle = area.y + area.height / 2;
  std::vector<std::string> rows = {first};
  if (!remedy && writer.WidthOf(first, em) > area.width) rows = writer.Rows(first, em, area.width);
  if (rows.size() > 2) rows = {rows.front(), first.substr(rows.front().size() + 1)};
  float y = middle - (remedy             ? 0.6F * (em + layout.em)
                      : rows.size() == 2 ? 1.25F * em
                                         : 0.65F * em);
  for (const std::string& row : rows) {
    writer.Text(area.x, y, area.width, em, row, ink);
    y += 1.2F * em;
  }
  if (remedy) writer.Text(area.x, y, area.width, layout.em, "→ " + strip.remedy, ink);
}

/// Glyph and word, and beside them the reason.
void AddStrip(const ViewFacts& facts, PictureWriter& writer) {
  const PictureLayout& layout = writer.layout();
  const scene::Area& area = layout.strip;
  const StateStrip strip = StripOf(facts);
  const StateMark& mark = MarkOf(strip.state);
  writer.Box(area, mark.fill);
  const bool filled = strip.state != StateClass::kHealthy && strip.state != StateClass::kAdvisory;
  const scene::Colour text = filled ? mark.ink : palette::kText;
  const float taken = AddCellAndClock(facts, text, writer);
  const std::string word = std::string(mark.glyph) + " " + strip.word;
  const float margin = 0.6F * layout.em;
  const float word_width =
      std::min(writer.WidthOf(word, layout.word_em) + 1, 0.6F * (area.width - taken));
  float x = area.x + margin;
  writer.Text(x, area.y + area.height / 2 - 0.65F * layout.word_em, word_width, layout.word_em,
              word, mark.ink);
  x += word_width + 2 * margin;
  AddReason(strip, {x, area.y, area.right() - taken - x, area.height}, text, writer);
}

/// Notes on a camera's image, with the tone of each.
std::vector<PanelLine> NotesOf(const OverlayInput& input, std::size_t k) {
  const cell::ViewState& state = *input.facts.state;
  const status::CameraStatus& status = cell::CameraOf(state, k).status;
  std::vector<PanelLine> notes;
  for (const std::string& reason : StaleReasons(input.facts, std::span(&k, 1)))
    notes.push_back({"STALE: " + reason, Tone::kAttention});
  if (notes.empty() && status.name != status::CameraName::kNone)
    notes.push_back({status::CameraNameText(status.name), Tone::kPlain});
  if (state.cameras.empty()) notes.push_back({"drawn from the joint positions", Tone::kFaded});
  if (input.config.exaggeration != 1 && k == input.facts.shown.front()) {
    notes.push_back({fmt::format("deflection exaggerated {:g} times", input.config.exaggeration),
                     Tone::kPlain});
  }
  const cell::ViewCamera& camera = cell::CameraOf(state, k);
  if (camera.lens && camera.usable_radius_px)
    notes.push_back({"lens calibrated inside the dashed line only", Tone::kAttention});
  if (status.prompt != lens::BoardPrompt::kNone) {
    notes.push_back({fmt::format("→ {}", lens::BoardPromptText(status.prompt)), Tone::kAttention});
  }
  return notes;
}

/// Adds the notes as a block in a corner of the image.
void AddNotes(const std::vector<PanelLine>& notes, const scene::Area& image, LabelPlacer& placer,
              PictureWriter& writer) {
  if (notes.empty()) return;
  const PictureLayout& layout = writer.layout();
  const float pad = 0.3F * layout.em, most = image.width - 4 * layout.em;
  float width = 0;
  for (const PanelLine& note : notes)
    width = std::max(width, std::min(most, writer.WidthOf(MarkedText(note), layout.em) + 1));
  const auto rows = static_cast<std::size_t>(std::clamp(
      (image.height - 2 * layout.em) / layout.line(), 1.0F, static_cast<float>(notes.size())));
  const scene::Area area =
      placer.TakeCorner(width + 2 * pad, static_cast<float>(rows) * layout.line() + pad,
                        {Corner::kTopLeft, Corner::kTopRight, Corner::kBottomLeft});
  writer.Box(area, palette::kShadow);
  for (std::size_t row = 0; row < rows; ++row) {
    writer.Line(area.x + pad, area.y + pad / 2 + static_cast<float>(row) * layout.line(), width,
                notes[row]);
  }
}

/// @param all  the placed labels: the leader line passes behind them
void AddLabel(const Label& label, const PlacedLabel& placed, const std::vector<PlacedLabel>& all,
              PictureWriter& writer) {
  const PictureLayout& layout = writer.layout();
  const float pad = 0.3F * layout.em;
  writer.Box(placed.area, palette::kShadow);
  for (const LeaderLine& part : PartsOutside(placed.leader, all)) {
    writer.Stroke({part.from, part.to}, label.colour, std::max(1.5F, 0.07F * layout.em));
  }
  writer.Text(placed.area.x + pad, placed.area.y, placed.area.width - 2 * pad, layout.em,
              label.text, label.colour.a < 1 ? palette::kFaded : label.colour);
}

void AddLabels(std::vector<Label> labels, LabelPlacer& placer, PictureWriter& writer) {
  const PictureLayout& layout = writer.layout();
  const float pad = 0.3F * layout.em;
  std::stable_sort(labels.begin(), labels.end(),
                   [](const Label& a, const Label& b) { return a.rank < b.rank; });
  const float most = 0.8F * layout.image.width;
  std::vector<PlacedLabel> all;
  std::vector<Label> shown;
  for (Label& label : labels) {
    const auto place = [&](const std::string& text) {
      const float width = std::min(writer.WidthOf(text, layout.em) + 1, most) + 2 * pad;
      return placer.Place({label.x, label.y}, width, layout.line());
    };
    if (label.text.empty()) label.text = "?";
    const bool fits = writer.WidthOf(label.text, layout.em) < most;
    auto placed = fits || label.shorter.empty() ? place(label.text) : std::nullopt;
    if (!placed && !label.shorter.empty()) {
      label.text = label.shorter;
      placed = place(label.text);
    }
    if (!placed) continue;
    all.push_back(*placed);
    shown.push_back(std::move(label));
  }
  for (std::size_t k = 0; k < all.size(); ++k) AddLabel(shown[k], all[k], all, writer);
}

}  // namespace

PictureLayout LayoutFor(const ViewFacts& facts, image::ImageSize size) {
  return LayoutOf(size, std::max<std::size_t>(1, facts.shown.size()), ImageSizeOf(facts));
}

void AddPanels(const ViewFacts& facts, const PictureLayout& layout, const TextWidth& text_width,
               scene::DisplayList& list) {
  PictureWriter writer(layout, text_width, list);
  AddStrip(facts, writer);
  if (const auto guiding = GuidingCamera(facts)) {
    AddBoardGuide(cell::CameraOf(*facts.state, *guiding), writer);
    return;
  }
  AddPointTiles(facts, writer);
  AddDetailBand(facts, writer);
}

bool AddAnnotations(const OverlayInput& input, std::size_t k, const PictureLayout& layout,
                    const ImageMarks& marks, const TextWidth& text_width, const lens::Lens& pinhole,
                    bool inset_wanted, scene::DisplayList& list) {
  PictureWriter writer(layout, text_width, list);
  const scene::Area& image = layout.image;
  LabelPlacer placer(image, layout.em);
  if (const cell::ViewCamera& camera = cell::CameraOf(*input.facts.state, k); IsGuiding(camera)) {
    AddBoardOutlines(camera, writer);
    if (camera.status.name != status::CameraName::kNone)
      AddNotes({{status::CameraNameText(camera.status.name)}}, image, placer, writer);
    return false;
  }
  for (const scene::Area& area : marks.keep_clear) placer.KeepClear(area);
  if (!StaleReasons(input.facts, std::span(&k, 1)).empty())
    writer.Frame(image, std::max(3.0F, 0.25F * layout.em), palette::kWarningFill);
  AddNotes(NotesOf(input, k), image, placer, writer);
  const bool first = k == input.facts.shown.front();
  if (first) AddStressScale(input, placer, writer);
  const auto inset = inset_wanted ? InsetOf(input, k, pinhole) : std::nullopt;
  const bool added = inset && AddTipInset(*inset, image, placer, writer);
  AddLabels(marks.labels, placer, writer);
  return added;
}

namespace {

/// Fills the gap between two neighbouring images.
void AddGap(const scene::Area& a, const scene::Area& b, scene::DisplayList& list) {
  const bool beside = b.x > a.x;
  const scene::Area gap = beside ? scene::Area{a.right(), a.y, b.x - a.right(), a.height}
                                 : scene::Area{a.x, a.bottom(), a.width, b.y - a.bottom()};
  list.boxes.push_back({gap.x, gap.y, gap.width, gap.height, palette::kGround});
}

scene::DisplayList PictureOfState(const OverlayInput& input, const PictureLayout& layout,
                                  const TextWidth& text_width) {
  scene::DisplayList list;
  const std::vector<std::size_t>& shown = input.facts.shown;
  const image::ImageSize size = ImageSizeOf(input.facts);
  // The layout may have been made for another number or size of images.
  const std::vector<scene::Area> parts =
      layout.images.size() == shown.size()
          ? layout.images
          : SplitArea(layout.image, shown.size(), size, kImageGap_em * layout.em);
  bool inset = false;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    PictureLayout part = layout;
    part.image = parts[i];
    if (i > 0) AddGap(parts[i - 1], parts[i], list);
    scene::DisplayList& view = i == 0 ? list : list.beside.emplace_back();
    view.area = part.image;  // nothing is drawn under the panels
    ImageMarks marks;
    AddOverlay(input, shown[i], part, view, marks);
    const lens::Lens pinhole = view.pinhole;
    inset =
        AddAnnotations(input, shown[i], part, marks, text_width, pinhole, !inset, list) || inset;
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
    return PictureOfState({silent, input.config, input.meshes, input.pixels, input.mesh_facts},
                          layout, text_width);
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

}  // namespace plumbline::display
