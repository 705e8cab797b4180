#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cairo.h>

#include <algorithm>
#include <memory>
#include <numbers>
#include <string_view>
#include <type_traits>

#include "app/version.h"
#include "app/vision/print/sheet_writer.h"

namespace plumbline::vision {
namespace {

constexpr double kPointsPerMm = 72 / 25.4;
constexpr double kTolerance = 1e-3;  // of curves, in points or millimetres

struct Destroy {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* context) const { cairo_destroy(context); }
  void operator()(cairo_font_options_t* options) const { cairo_font_options_destroy(options); }
};
using Surface = std::unique_ptr<cairo_surface_t, Destroy>;
using Context = std::unique_ptr<cairo_t, Destroy>;

struct Sink {
  TakeBytes* take;
  void* file;
};

cairo_status_t Pass(void* sink, const unsigned char* bytes, unsigned count) {
  const Sink& to = *static_cast<Sink*>(sink);
  to.take(to.file, bytes, count);
  return CAIRO_STATUS_SUCCESS;
}

/// A surface of the paper's size. One user unit is a point in PDF and a millimetre in SVG, whose
/// coordinates cairo rounds to 1/256 of a unit.
Surface SurfaceOf(const Document& document, SheetFormat format, Sink& sink) {
  if (format == SheetFormat::kSvg) {
    Surface svg(
        cairo_svg_surface_create_for_stream(Pass, &sink, document.size.x(), document.size.y()));
    cairo_svg_surface_set_document_unit(svg.get(), CAIRO_SVG_UNIT_MM);
    return svg;
  }
  const Vec2 size = kPointsPerMm * document.size;
  Surface pdf(cairo_pdf_surface_create_for_stream(Pass, &sink, size.x(), size.y()));
  cairo_pdf_surface_set_metadata(pdf.get(), CAIRO_PDF_METADATA_TITLE, document.title.c_str());
  cairo_pdf_surface_set_metadata(pdf.get(), CAIRO_PDF_METADATA_CREATOR,
                                 "Plumbline " PLUMBLINE_VERSION);
  return pdf;
}

void DrawText(cairo_t* context, const Text& text) {
  if (text.words.empty()) return;
  cairo_select_font_face(
      context, text.font == Font::kFixedPitch ? "DejaVu Sans Mono" : "DejaVu Sans",
      CAIRO_FONT_SLANT_NORMAL,
      text.font == Font::kBold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context, text.size);
  cairo_text_extents_t extents;
  cairo_text_extents(context, text.words.c_str(), &extents);
  if (extents.x_advance > text.max_width) {
    cairo_set_font_size(context, text.size * text.max_width / extents.x_advance);
  }
  const double width = std::min(extents.x_advance, text.max_width);
  const double left = text.align == Align::kLeft     ? 0
                      : text.align == Align::kCentre ? 0.5 * width
                                                     : width;
  cairo_move_to(context, text.at.x() - left, text.at.y());
  cairo_show_text(context, text.words.c_str());
}

void DrawSheet(cairo_t* context, const Sheet& sheet) {
  cairo_set_source_rgb(context, 1, 1, 1);
  cairo_paint(context);
  cairo_set_source_rgb(context, 0, 0, 0);
  cairo_set_fill_rule(context, CAIRO_FILL_RULE_EVEN_ODD);
  for (const Outline& outline : sheet.outlines) {
    for (const Vec2& corner : outline) cairo_line_to(context, corner.x(), corner.y());
    cairo_close_path(context);
    cairo_new_sub_path(context);
  }
  cairo_fill(context);
  for (const Disc& disc : sheet.discs) {
    cairo_new_sub_path(context);
    cairo_arc(context, disc.centre.x(), disc.centre.y(), disc.radius, 0, 2 * std::numbers::pi);
  }
  cairo_fill(context);
  for (const Line& line : sheet.lines) {
    cairo_set_source_rgb(context, line.grey, line.grey, line.grey);
    cairo_set_line_width(context, line.width);
    cairo_move_to(context, line.from.x(), line.from.y());
    cairo_line_to(context, line.to.x(), line.to.y());
    cairo_stroke(context);
  }
  cairo_set_source_rgb(context, 0, 0, 0);
  for (const Text& text : sheet.texts) DrawText(context, text);
  cairo_show_page(context);
}

const char* Draw(const Document& document, SheetFormat format, TakeBytes* take, void* file) {
  Sink sink{take, file};
  const Surface surface = SurfaceOf(document, format, sink);
  const Context context(cairo_create(surface.get()));
  cairo_set_tolerance(context.get(), kTolerance);
  const std::unique_ptr<cairo_font_options_t, Destroy> unhinted(cairo_font_options_create());
  cairo_font_options_set_hint_style(unhinted.get(), CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(unhinted.get(), CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options(context.get(), unhinted.get());
  if (format == SheetFormat::kPdf) cairo_scale(context.get(), kPointsPerMm, kPointsPerMm);
  for (const Sheet& sheet : document.sheets) DrawSheet(context.get(), sheet);
  cairo_status_t status = cairo_status(context.get());
  cairo_surface_finish(surface.get());
  if (status == CAIRO_STATUS_SUCCESS) status = cairo_surface_status(surface.get());
  return status == CAIRO_STATUS_SUCCESS ? nullptr : cairo_status_to_string(status);
}

}  // namespace
}  // namespace plumbline::vision

/// The only function of the module, see plumbline::vision::DrawSheets.
extern "C" __attribute__((visibility("default"))) const char* plumbline_draw_sheets_1(
    const plumbline::vision::Document& document, plumbline::vision::SheetFormat format,
    plumbline::vision::TakeBytes* take, void* file) {
  return plumbline::vision::Draw(document, format, take, file);
}

// The programs look this function up by name.
static_assert(std::string_view(plumbline::vision::kDrawSheetsName) == "plumbline_draw_sheets_1");
static_assert(std::is_same_v<decltype(plumbline_draw_sheets_1), plumbline::vision::DrawSheets>);
