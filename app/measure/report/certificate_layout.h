// Layout of the certificate in print: height of its texts, and what that leaves for its figures.
#pragma once

#include <string>

namespace plumbline::measure {

/// Width of a figure of the certificate [px]; printed, it is as wide as the text.
inline constexpr int kCertificateFigureWidth = 700;

/// Heights of the certificate's figures [px], at a width of kCertificateFigureWidth.
struct FigureHeights {
  int points = 100, deciding = 130;
};

/// Upper estimate of the printed height [mm] of paragraphs and tables below each other, from the
/// number of characters in the widest of the typefaces used (DejaVu Sans). Figures do not count.
double PrintedHeight_mm(const std::string& html);

/// Heights with which the figures fill what the texts leave of the page, the deciding figure being
/// the larger one; the default heights if the texts leave less.
/// @param texts_mm   height of all texts, with the figures' captions [mm]
/// @param has_points false if there is no figure of the errors at the poses
FigureHeights HeightsBeside(double texts_mm, bool has_points);

}  // namespace plumbline::measure
