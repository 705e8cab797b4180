// Magnified inset: one assembly point to scale, with its uncorrected and corrected tip position.
#pragma once

#include <optional>
#include <string>

#include "app/display/view/label_placement.h"
#include "app/display/view/overlay.h"
#include "app/display/view/picture_writer.h"

namespace plumbline::display {

/// Contents of the inset in millimetres of a view V: x to the right, y down. V is the image plane,
/// or, where the camera looks along the correction, the plane of two axes of W.
struct TipInset {
  std::string name;                                ///< of the point
  lens::Vec2 uncorrected_mm = lens::Vec2::Zero();  ///< relative to the taught position
  double radius_mm = 0;          ///< 95 %, of the corrected position; 0 if its basis is unknown
  Mat3 R_VW = Mat3::Identity();  ///< directions of the axes
  double image_px_per_mm = 0;    ///< scale of the picture at the point; 0 if not in it
};

/// The valid point nearest to the tip. Positions are those of AddOverlay(), without exaggeration.
/// Without a camera, or while the pose of the cell in its frame is unknown, the view is along an
/// axis of W.
/// @return  nullopt if no point is valid
std::optional<TipInset> InsetOf(const OverlayInput& input, std::size_t k,
                                const lens::Lens& pinhole);

/// Adds the inset in a corner of the image where it covers nothing that is kept clear.
/// @return  false if there is no such corner, or the image is too small
bool AddTipInset(const TipInset& inset, const scene::Area& image, LabelPlacer& placer,
                 PictureWriter& writer);

/// Largest of 1, 2, 5 times a power of ten that is not above `value` > 0.
double RoundedDown125(double value);

}  // namespace plumbline::display
