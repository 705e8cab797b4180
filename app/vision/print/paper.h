// Paper sizes.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "app/vision/print/sheet.h"

namespace plumbline::vision {

struct Paper {
  std::string_view name;
  double short_mm = 0, long_mm = 0;

  /// Width and height [mm].
  Vec2 Size(bool landscape) const {
    return landscape ? Vec2(long_mm, short_mm) : Vec2(short_mm, long_mm);
  }
};

/// A4, A3 (ISO 216) and letter (ANSI/ASME Y14.1), from the smallest to the largest area.
std::span<const Paper> Papers();

/// The paper called "A4", "A3" or "letter".
std::optional<Paper> PaperOfName(std::string_view name);

}  // namespace plumbline::vision
