#include "firmware-like/model/section.h"

#include <algorithm>
#include <numbers>

namespace plumbline::model {
namespace {

constexpr double kPi = std::numbers::pi;

double Pow4(double value) {
  return value * value * value * value;
}

/// Integral of (c - y^2)^2 from 0 to y.
double ParabolaSquared(double c, double y) {
  return c * c * y - 2 * c * y * y * y / 3 + y * y * y * y * y / 5;
}

/// Doubly symmetric section of two flanges joined by webs: a box (two webs at the edges) or an I
/// (one web in the middle).
struct FlangedSection {
  double width_m;
  double height_m;
  double webs_m;    ///< thickness of all webs together
  double flange_m;  ///< thickness of one flange

  double InnerHeight() const { return height_m - 2 * flange_m; }
  double Area() const { return width_m * height_m - (width_m - webs_m) * InnerHeight(); }

  /// Second moment about x.
  double Ix() const {
    const double inner_m = InnerHeight();
    return (width_m * height_m * height_m * height_m -
            (width_m - webs_m) * inner_m * inner_m * inner_m) /
           12;
  }

  /// First moment of one flange about x.
  double FlangeMoment() const {
    return width_m * (height_m * height_m - InnerHeight() * InnerHeight()) / 8;
  }

  /// kappa for a force along y from the strain energy of the shear flow: along the webs, through
  /// the thickness of the flanges, and along the four free halves of the flanges towards the webs.
  double ShearCoefficientY() const {
    const double inner_m = InnerHeight();
    const double c = height_m * height_m / 4;
    const double in_flanges =
        width_m / 2 * (ParabolaSquared(c, height_m / 2) - ParabolaSquared(c, inner_m / 2));
    const double q = FlangeMoment();
    const double inner3 = inner_m * inner_m * inner_m;
    const double in_webs =
        q * q * inner_m / webs_m + q * inner3 / 6 + webs_m * inner3 * inner_m * inner_m / 120;
    const double lip_m = (width_m - webs_m) / 2;
    const double arm_m = height_m - flange_m;
    const double along_flanges = lip_m * lip_m * lip_m * flange_m * arm_m * arm_m / 3;
    return Ix() * Ix() / (Area() * (in_flanges + in_webs + along_flanges));
  }

  /// I t / Q at the neutral axis, for a force along y.
  double PeakShearAreaY() const {
    const double inner_m = InnerHeight();
    return Ix() * webs_m / (FlangeMoment() + webs_m * inner_m * inner_m / 8);
  }
};

}  // namespace

Section RectangleSection(double b_m, double h_m) {
  const double area_m2 = b_m * h_m;
  return {.area_m2 = area_m2,
          .ix_m4 = b_m * h_m * h_m * h_m / 12,
          .iy_m4 = h_m * b_m * b_m * b_m / 12,
          .reach_x_m = b_m / 2,
          .reach_y_m = h_m / 2,
          .peak_shear_x_m2 = area_m2 / 1.5,
          .peak_shear_y_m2 = area_m2 / 1.5};
}

Section SquareTubeSection(double side_m, double wall_m) {
  const FlangedSection box{side_m, side_m, 2 * wall_m, wall_m};
  const double kappa = box.ShearCoefficientY();
  const double peak_m2 = box.PeakShearAreaY();
  return {.area_m2 = box.Area(),
          .ix_m4 = box.Ix(),
          .iy_m4 = box.Ix(),
          .shear_x = kappa,
          .shear_y = kappa,
          .reach_x_m = side_m / 2,
          .reach_y_m = side_m / 2,
          .peak_shear_x_m2 = peak_m2,
          .peak_shear_y_m2 = peak_m2};
}

Section TubeSection(double outer_diameter_m, double wall_m, double poisson_ratio) {
  const double outer_m = outer_diameter_m / 2;
  const double inner_m = outer_m - wall_m;
  const double moment_m4 = kPi / 4 * (Pow4(outer_m) - Pow4(inner_m));
  const double m2 = (inner_m / outer_m) * (inner_m / outer_m);
  const double nu = poisson_ratio;
  const double one_m2 = (1 + m2) * (1 + m2);
  const double kappa = 6 * (1 + nu) * one_m2 / ((7 + 6 * nu) * one_m2 + (20 + 12 * nu) * m2);
  const double half_moment_m3 =
      2.0 / 3 * (outer_m * outer_m * outer_m - inner_m * inner_m * inner_m);
  const double peak_m2 = moment_m4 * 2 * wall_m / half_moment_m3;
  return {.area_m2 = kPi * (outer_m * outer_m - inner_m * inner_m),
          .ix_m4 = moment_m4,
          .iy_m4 = moment_m4,
          .shear_x = kappa,
          .shear_y = kappa,
          .reach_x_m = outer_m,
          .reach_y_m = outer_m,
          .round = true,
          .peak_shear_x_m2 = peak_m2,
          .peak_shear_y_m2 = peak_m2};
}

Section RodSection(double diameter_m, double poisson_ratio) {
  return TubeSection(diameter_m, diameter_m / 2, poisson_ratio);
}

Section IBeamSection(double height_m, double width_m, double web_m, double flange_m) {
  const FlangedSection beam{width_m, height_m, web_m, flange_m};
  const double flanges_m2 = 2 * width_m * flange_m;
  return {.area_m2 = beam.Area(),
          .ix_m4 = beam.Ix(),
          .iy_m4 = (2 * flange_m * width_m * width_m * width_m +
                    beam.InnerHeight() * web_m * web_m * web_m) /
                   12,
          .shear_x = 5.0 / 6 * flanges_m2 / beam.Area(),
          .shear_y = beam.ShearCoefficientY(),
          .reach_x_m = width_m / 2,
          .reach_y_m = height_m / 2,
          .peak_shear_x_m2 = flanges_m2 / 1.5,
          .peak_shear_y_m2 = beam.PeakShearAreaY()};
}

Section SectionFromMoments(double area_m2, double ix_m4, double iy_m4) {
  return {.area_m2 = area_m2, .ix_m4 = ix_m4, .iy_m4 = iy_m4};
}

}  // namespace plumbline::model
