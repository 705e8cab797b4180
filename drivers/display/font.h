// Font rasteriser on FreeType: glyphs as grey bitmaps.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/result.h"

struct FT_LibraryRec_;
struct FT_FaceRec_;

namespace plumbline::display {

/// Paths of DejaVu Sans on Debian (fonts-dejavu-core) and on other distributions.
std::vector<std::string> DefaultFontPaths();

/// One glyph. The bitmap holds coverage, 0 outside, row by row from the top without padding.
struct Glyph {
  int width = 0, height = 0;  ///< bitmap size [px]
  int left = 0;               ///< from the pen to the first column [px]
  int top = 0;                ///< from the baseline up to the first row [px]
  int advance = 0;            ///< to the next pen position [px]
  std::vector<std::uint8_t> coverage;
};

class Font {
 public:
  static constexpr int kMinSize_px = 6, kMaxSize_px = 200;

  /// Opens the first of `paths` that is a scalable font.
  static Result<Font> Open(std::span<const std::string> paths);

  /// @param size_px  size of the em square, clamped to kMinSize_px..kMaxSize_px
  /// @return  the glyph, a box for an unknown code point; nullopt if the font is damaged
  std::optional<Glyph> Rasterise(char32_t code_point, int size_px);

 private:
  struct Close {
    void operator()(FT_LibraryRec_* library) const;
    void operator()(FT_FaceRec_* face) const;
  };
  std::unique_ptr<FT_LibraryRec_, Close> library_;
  std::unique_ptr<FT_FaceRec_, Close> face_;  ///< destroyed before library_
  int size_px_ = 0;
};

/// Decodes UTF-8; each invalid byte becomes U+FFFD. Pure.
std::u32string CodePointsFromUtf8(std::string_view utf8);

}  // namespace plumbline::display
