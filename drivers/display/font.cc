#include "drivers/display/font.h"

#include <fmt/format.h>
#include <ft2build.h>
#include FT_FREETYPE_H

#include <algorithm>
#include <utility>

namespace plumbline::display {

void Font::Close::operator()(FT_LibraryRec_* library) const {
  FT_Done_FreeType(library);
}
void Font::Close::operator()(FT_FaceRec_* face) const {
  FT_Done_Face(face);
}

std::vector<std::string> DefaultFontPaths() {
  return {"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
          "/usr/share/fonts/dejavu/DejaVuSans.ttf", "/usr/share/fonts/TTF/DejaVuSans.ttf"};
}

Result<Font> Font::Open(std::span<const std::string> paths) {
  Font font;
  FT_Library library = nullptr;
  if (FT_Init_FreeType(&library) != 0) return Error{"FreeType cannot be initialised"};
  font.library_.reset(library);
  std::string tried;
  for (const std::string& path : paths) {
    FT_Face face = nullptr;
    const FT_Error problem = FT_New_Face(library, path.c_str(), 0, &face);
    if (problem == 0) {
      font.face_.reset(face);
      if (FT_IS_SCALABLE(face)) return font;
      font.face_.reset();
    }
    tried += fmt::format("{}{}", tried.empty() ? "" : ", ", path);
  }
  return Error{
      fmt::format("no font found among {}. Text is not drawn. Install fonts-dejavu-core.", tried)};
}

std::optional<Glyph> Font::Rasterise(char32_t code_point, int size_px) {
  size_px = std::clamp(size_px, kMinSize_px, kMaxSize_px);
  FT_Face face = face_.get();
  if (size_px != size_px_) {
    if (FT_Set_Pixel_Sizes(face, 0, static_cast<FT_UInt>(size_px)) != 0) return std::nullopt;
    size_px_ = size_px;
  }
  if (FT_Load_Char(face, code_point, FT_LOAD_RENDER | FT_LOAD_TARGET_LIGHT) != 0)
    return std::nullopt;
  const FT_GlyphSlot slot = face->glyph;
  const FT_Bitmap& bitmap = slot->bitmap;
  Glyph glyph;
  glyph.left = slot->bitmap_left;
  glyph.top = slot->bitmap_top;
  glyph.advance = static_cast<int>((slot->advance.x + 32) / 64);
  if (bitmap.buffer == nullptr) return glyph;  // a space
  if (bitmap.pixel_mode != FT_PIXEL_MODE_GRAY || bitmap.pitch < 0) return std::nullopt;
  glyph.width = static_cast<int>(bitmap.width);
  glyph.height = static_cast<int>(bitmap.rows);
  for (unsigned row = 0; row < bitmap.rows; ++row) {
    const std::uint8_t* from =
        bitmap.buffer + std::size_t{row} * static_cast<unsigned>(bitmap.pitch);
    glyph.coverage.insert(glyph.coverage.end(), from, from + bitmap.width);
  }
  return glyph;
}

std::u32string CodePointsFromUtf8(std::string_view utf8) {
  constexpr char32_t kReplacement = 0xFFFD;
  std::u32string code_points;
  for (std::size_t i = 0; i < utf8.size();) {
    const auto byte = [&](std::size_t k) -> unsigned {
      return k < utf8.size() ? static_cast<unsigned char>(utf8[k]) : 0U;
    };
    const unsigned lead = byte(i);
    const std::size_t more = lead < 0x80   ? 0
                             : lead < 0xC2 ? 9
                             : lead < 0xE0 ? 1
                             : lead < 0xF0 ? 2
                             : lead < 0xF5 ? 3
                                           : 9;
    char32_t code_point = more == 0 ? lead : lead & (0x3FU >> more);
    bool whole = more < 9;
    for (std::size_t k = 1; whole && k <= more; ++k) {
      whole = (byte(i + k) & 0xC0U) == 0x80U;
      code_point = code_point << 6U | (byte(i + k) & 0x3FU);
    }
    // Overlong encoding, surrogate, or beyond the last code point.
    whole = whole && !(more == 2 && code_point < 0x800) && !(more == 3 && code_point < 0x10000) &&
            !(code_point >= 0xD800 && code_point < 0xE000) && code_point <= 0x10FFFF;
    code_points.push_back(whole ? code_point : kReplacement);
    i += whole ? more + 1 : 1;
  }
  return code_points;
}

}  // namespace plumbline::display
