#include "app/display/view/board_guide.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>
#include <span>

#include "app/display/view/palette.h"

namespace plumbline::display {
namespace {

constexpr float kWidestEdge = 1.8F, kThinnestEdge = 0.55F;  ///< relative to the usual width
constexpr float kInstruction = 1.5F;  ///< height of the instruction, relative to the state word
constexpr float kInstructionRoom = 0.55F;  ///< most of the band's height that it takes
constexpr float kRingWidth = 0.17F;        ///< of its radius
constexpr int kSegmentSides = 24;

/// From a pixel of a camera image, drawn without undistortion, to a point of the picture.
class ImageToPicture {
 public:
  ImageToPicture(const scene::Area& area, const cell::ViewImage& image)
      : lens_(PlainLens({image.width, image.height})),
        pinhole_(PinholeIn(area, lens_, {image.width, image.height})) {}

  scene::PicturePoint operator()(const lens::Vec2& pixel) const {
    // Pixel (0, 0) is the centre of a pixel; strokes count from its edge.
    return {
        static_cast<float>((pixel.x() - lens_.cx) * pinhole_.fx / lens_.fx + pinhole_.cx + 0.5),
        static_cast<float>((pixel.y() - lens_.cy) * pinhole_.fy / lens_.fy + pinhole_.cy + 0.5)};
  }

 private:
  lens::Lens lens_, pinhole_;
};

std::vector<scene::PicturePoint> PointsOf(const std::vector<lens::Vec2>& pixels,
                                          const ImageToPicture& to_picture) {
  std::vector<scene::PicturePoint> points;
  for (const lens::Vec2& pixel : pixels) points.push_back(to_picture(pixel));
  return points;
}

float LengthOf(std::span<const scene::PicturePoint> points) {
  return std::hypot(points.back().x - points.front().x, points.back().y - points.front().y);
}

/// The four edges of a closed outline, the nearer one of two opposite edges wider: it is longer.
/// @param casing  added to all widths
void AddNearnessOutline(const std::vector<scene::PicturePoint>& outline,
                        const scene::Colour& colour, float width, float casing,
                        PictureWriter& writer) {
  const std::size_t parts = outline.size() / 4;  // segments of an edge
  const auto edge = [&](std::size_t k) {
    return std::span(outline).subspan(k % 4 * parts, parts + 1);
  };
  std::array<float, 4> widths{};
  for (std::size_t k = 0; k < 4; ++k) {
    const float ratio = LengthOf(edge(k)) / std::max(1.0F, LengthOf(edge(k + 2)));
    widths[k] = width * std::clamp(std::pow(ratio, 3.0F), kThinnestEdge, kWidestEdge);
    writer.Stroke({edge(k).begin(), edge(k).end()}, colour, widths[k] + casing);
  }
  for (std::size_t k = 0; k < 4; ++k)
    writer.Disc(edge(k).front(), 0.5F * (std::max(widths[k], widths[(k + 3) % 4]) + casing),
                colour);
}

std::string Capitalised(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

/// Arrow in the direction of a move; empty for other instructions.
std::string ArrowOf(lens::BoardPrompt prompt) {
  using lens::BoardPrompt;
  switch (prompt) {
    case BoardPrompt::kLeft:
      return "← ";
    case BoardPrompt::kRight:
      return "→ ";
    case BoardPrompt::kUp:
      return "↑ ";
    case BoardPrompt::kDown:
      return "↓ ";
    case BoardPrompt::kUpperLeft:
      return "↖ ";
    case BoardPrompt::kUpperRight:
      return "↗ ";
    case BoardPrompt::kLowerLeft:
      return "↙ ";
    case BoardPrompt::kLowerRight:
      return "↘ ";
    default:
      return "";
  }
}

void AddInstruction(const cell::ViewCamera& camera, const scene::Area& area,
                    PictureWriter& writer) {
  const PictureLayout& layout = writer.layout();
  const bool met = camera.guidance->met;
  writer.Box(area, met ? palette::kMetFill : palette::kPanel);
  const lens::BoardPrompt prompt = camera.status.prompt;
  const std::string text = ArrowOf(prompt) + CameraPrefix(camera) +
                           Capitalised(std::string(lens::BoardPromptText(prompt)));
  const float margin = layout.em, width = area.width - 2 * margin;
  const float most =
      std::floor(std::min(kInstruction * layout.word_em, kInstructionRoom * area.height));
  const float em = writer.FittingEm(text, most, width);
  writer.Text(area.x + (area.width - std::min(width, writer.WidthOf(text, em))) / 2,
              area.y + area.height / 2 - 0.65F * em, width, em, text,
              met ? palette::kDarkText : palette::kText);
}

/// One segment for each view; the captured ones are filled.
void AddRing(const lens::BoardGuidance& guidance, scene::PicturePoint centre, float radius,
             PictureWriter& writer) {
  const PictureLayout& layout = writer.layout();
  const int all = std::max<int>(guidance.expected_views, 2);
  const auto at = [&](float turn, float distance) {
    const auto angle = static_cast<float>(2 * std::numbers::pi) * turn / static_cast<float>(all);
    return scene::PicturePoint{centre.x + distance * std::sin(angle),
                               centre.y - distance * std::cos(angle)};
  };
  for (int k = 0; k < all; ++k) {
    std::vector<scene::PicturePoint> sector{centre};
    for (int i = 0; i <= kSegmentSides; ++i)
      sector.push_back(at(static_cast<float>(k) + static_cast<float>(i) / kSegmentSides, radius));
    sector.push_back(centre);
    writer.Polygon(std::move(sector), k < guidance.views ? palette::kMet : palette::kOpen);
  }
  for (int k = 0; k < all; ++k)
    writer.Stroke({centre, at(static_cast<float>(k), radius)}, palette::kPanel,
                  std::max(2.0F, 0.15F * layout.em));
  const float inside = (1 - kRingWidth) * radius;
  writer.Disc(centre, inside, palette::kPanel);
  const std::string count = fmt::format("{}", guidance.views);
  const float inner = 1.6F * inside;
  const float em =
      writer.FittingEm(count, std::floor(std::min(layout.value_em, 0.8F * radius)), inner);
  const float small = std::floor(std::min(layout.em, 0.36F * radius));
  const std::string about = fmt::format("of about {}", guidance.expected_views);
  const std::string rest =
      writer.WidthOf(about, small) < inner ? about : fmt::format("of {}", guidance.expected_views);
  const auto centred = [&](const std::string& text, float y, float height,
                           const scene::Colour& colour) {
    const float text_width = std::min(inner, writer.WidthOf(text, height) + 1);
    writer.Text(centre.x - text_width / 2, y, text_width, height, text, colour);
  };
  centred(count, centre.y - 0.85F * em, em, palette::kText);
  centred(rest, centre.y + 0.4F * em, small, palette::kFaded);
}

/// Opacity of the unknown by how far the claim is from being met.
float Unknown(float ratio) {
  return ratio <= 1 ? 0 : ratio <= 2 ? 0.4F : ratio <= 5 ? 0.7F : 1.0F;
}

void AddMap(const lens::BoardGuidance& guidance, const cell::ViewImage& image,
            const scene::Area& area, PictureWriter& writer) {
  const auto columns = static_cast<float>(guidance.columns);
  const auto rows = static_cast<float>(guidance.rows);
  writer.Box(area, palette::kOpen);
  for (std::size_t k = 0; k < guidance.uncertainty.size(); ++k) {
    const float opacity = Unknown(guidance.uncertainty[k]);
    if (!(opacity > 0)) continue;
    const auto column = static_cast<float>(k % guidance.columns);
    const auto row = static_cast<float>(k / guidance.columns);
    scene::Colour colour = palette::kWarningFill;
    colour.a = opacity;
    writer.Box({area.x + column / columns * area.width, area.y + row / rows * area.height,
                area.width / columns, area.height / rows},
               colour);
  }
  writer.Stroke(PointsOf(guidance.wanted_px, ImageToPicture(area, image)), palette::kDarkText,
                std::max(2.0F, 0.12F * writer.layout().em));
}

}  // namespace

bool IsGuiding(const cell::ViewCamera& camera) {
  return camera.status.state == lens::ZoomState::kCalibrating && camera.guidance && camera.image &&
         !camera.guidance->wanted_px.empty();
}

std::optional<std::size_t> GuidingCamera(const ViewFacts& facts) {
  if (facts.state == nullptr) return std::nullopt;
  for (const std::size_t k : facts.shown) {
    if (IsGuiding(cell::CameraOf(*facts.state, k))) return k;
  }
  return std::nullopt;
}

std::string BoardViewsText(const cell::ViewCamera& camera) {
  if (camera.guidance)
    return fmt::format("{} of about {} views", camera.guidance->views,
                       camera.guidance->expected_views);
  return fmt::format("{} view{}", camera.status.board_views,
                     camera.status.board_views == 1 ? "" : "s");
}

void AddBoardOutlines(const cell::ViewCamera& camera, PictureWriter& writer) {
  const lens::BoardGuidance& guidance = *camera.guidance;
  const PictureLayout& layout = writer.layout();
  const ImageToPicture to_picture(layout.image, *camera.image);
  const float width = std::max(3.0F, 0.3F * layout.em);
  if (!guidance.seen_px.empty())
    writer.Stroke(PointsOf(guidance.seen_px, to_picture), palette::kTaught, 0.6F * width);
  const std::vector<scene::PicturePoint> wanted = PointsOf(guidance.wanted_px, to_picture);
  AddNearnessOutline(wanted, palette::kDarkText, width, width, writer);  // legible on any image
  AddNearnessOutline(wanted, guidance.met ? palette::kMet : palette::kWarningFill, width, 0,
                     writer);
}

void AddBoardGuide(const cell::ViewCamera& camera, PictureWriter& writer) {
  const lens::BoardGuidance& guidance = *camera.guidance;
  const PictureLayout& layout = writer.layout();
  const float gap = Gap(layout);
  writer.Box(layout.tiles, palette::kGround);
  writer.Box(layout.band, palette::kGround);
  scene::Area progress = layout.tiles, instruction = layout.band;
  if (instruction.height < 2.2F * layout.name_em) {  // there is one row below the image
    instruction = layout.tiles;
    instruction.width = std::round(0.66F * layout.tiles.width);
    progress.x += instruction.width;
    progress.width -= instruction.width;
  }
  const auto inset = [&](scene::Area area) {
    return scene::Area{area.x + gap, area.y + gap, area.width - 2 * gap, area.height - 2 * gap};
  };
  AddInstruction(camera, inset(instruction), writer);
  progress = inset(progress);
  writer.Box(progress, palette::kPanel);
  // Ring and map side by side, or the ring above the map.
  const bool beside = progress.width > 1.3F * progress.height;
  const float pad = layout.em;
  const scene::Area ring{progress.x, progress.y, beside ? 0.4F * progress.width : progress.width,
                         beside ? progress.height : 0.5F * progress.height};
  const float radius = 0.5F * std::min(ring.width, ring.height) - 0.6F * pad;
  AddRing(guidance, {ring.x + ring.width / 2, ring.y + ring.height / 2}, radius, writer);
  const scene::Area rest{beside ? ring.right() : progress.x, beside ? progress.y : ring.bottom(),
                         beside ? progress.width - ring.width : progress.width,
                         beside ? progress.height : progress.height - ring.height};
  const float text = 1.3F * layout.name_em, room = rest.width - 2 * pad;
  const float most = rest.height - text - (beside ? 2 : 2.4F) * layout.line();
  const float scale = std::min(room / static_cast<float>(camera.image->width),
                               most / static_cast<float>(camera.image->height));
  if (!(scale > 0)) return;
  const scene::Area map{rest.x + pad, rest.y + 0.4F * pad,
                        scale * static_cast<float>(camera.image->width),
                        scale * static_cast<float>(camera.image->height)};
  AddMap(guidance, *camera.image, map, writer);
  const std::string certain = fmt::format("{:.0f} % certain", 100 * guidance.CertainShare());
  writer.Text(map.x, map.bottom() + 0.2F * pad, room,
              writer.FittingEm(certain, layout.name_em, room), certain, palette::kText);
  const bool known = guidance.CertainShare() == 1;
  const PanelLine next = known ? PanelLine{"further views confirm it"}
                               : PanelLine{"amber: not certain yet", Tone::kAttention};
  writer.Text(map.x, map.bottom() + 0.2F * pad + text, room, layout.em, next.text,
              palette::OfTone(next.tone));
}

}  // namespace plumbline::display
