// Letters of a TrueType font as grey bitmaps, by FreeType.
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

namespace plumbline {

/// Where Debian's fonts-dejavu-core puts its font, and other systems theirs.
std::vector<std::string> UsualFontPaths();

/// One letter. Pixels are coverages, 0 outside, row by row from the top without padding.
struct Glyph {
  int width = 0, height = 0;  ///< of the bitmap [px]
  int left = 0;               ///< from the pen to its first column
  int top = 0;                ///< from the base line up to its first row
  int advance = 0;            ///< to the next pen place [px]
  std::vector<std::uint8_t> coverage;
};

class Font {
 public:
  static constexpr int kSmallest_px = 6, kLargest_px = 200;

  /// The first of `paths` that is a font.
  static Result<Font> Open(std::span<const std::string> paths);

  /// @param size_px  of the em square, brought into kSmallest_px..kLargest_px
  /// @return  a box for what the font does not know; nothing where it is damaged
  std::optional<Glyph> Rasterise(char32_t letter, int size_px);

 private:
  struct Close {
    void operator()(FT_LibraryRec_* library) const;
    void operator()(FT_FaceRec_* face) const;
  };
  std::unique_ptr<FT_LibraryRec_, Close> library_;
  std::unique_ptr<FT_FaceRec_, Close> face_;  ///< goes before the library
  int size_px_ = 0;
};

/// Letters of a UTF-8 text; U+FFFD for each byte that belongs to none. Pure.
std::u32string LettersOf(std::string_view utf8);

}  // namespace plumbline
