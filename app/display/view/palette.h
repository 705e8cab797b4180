// Colours of the display. Neutral greys; a hue marks what is abnormal (ISA-101). Text on its
// background has a contrast ratio of at least 7:1.
#pragma once

#include "app/display/view/status_text.h"
#include "firmware-like/scene/display_list.h"

namespace plumbline::display::palette {

constexpr scene::Colour FromRgb(unsigned rgb, float opacity = 1) {
  return {static_cast<float>(rgb >> 16U & 0xFFU) / 255.0F,
          static_cast<float>(rgb >> 8U & 0xFFU) / 255.0F, static_cast<float>(rgb & 0xFFU) / 255.0F,
          opacity};
}

inline constexpr scene::Colour kGround = FromRgb(0x1b1e23), kPanel = FromRgb(0x24282f),
                               kText = FromRgb(0xe6e8eb), kFaded = FromRgb(0xb4bbc3),
                               kDarkText = FromRgb(0x07090b), kShadow = FromRgb(0x14171b, 0.92F);
/// Text and glyphs of an abnormal state, on kGround, kPanel and kShadow.
inline constexpr scene::Colour kAdvisory = FromRgb(0x86c4f4), kWarning = FromRgb(0xf5c04e),
                               kAlarm = FromRgb(0xff9c96);
/// Areas filled with the colour of an abnormal state, under kDarkText.
inline constexpr scene::Colour kWarningFill = FromRgb(0xf0b429), kAlarmFill = FromRgb(0xff7a75);
/// Marks in the image, which also differ in shape.
inline constexpr scene::Colour kTaught = FromRgb(0xffffff), kUncorrected = FromRgb(0xdcb0ff),
                               kCorrected = FromRgb(0x6fe0ff);

/// Guidance of a person: what is done, as a mark and as an area under kDarkText, and what is open.
inline constexpr scene::Colour kMet = FromRgb(0x5fe08a), kMetFill = FromRgb(0x4ccb78),
                               kOpen = FromRgb(0x4a525d);

/// Text of a tone. Normal states have no hue.
constexpr scene::Colour OfTone(Tone tone) {
  switch (tone) {
    case Tone::kPlain:
    case Tone::kGood:
      return kText;
    case Tone::kAttention:
      return kWarning;
    case Tone::kBad:
      return kAlarm;
    case Tone::kFaded:
      return kFaded;
  }
  return kText;
}

}  // namespace plumbline::display::palette
