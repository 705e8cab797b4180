// Cross-section and material of a tool segment.
#pragma once

#include <optional>
#include <string_view>

namespace plumbline::model {

/// A cross-section in the plane normal to the tool's z axis, with width along x and height along y.
/// `ix_m4` (about x) resists bending along y; `iy_m4` (about y) resists bending along x.
struct Section {
  double area_m2 = 0;
  double ix_m4 = 0;
  double iy_m4 = 0;
  double shear_x = 5.0 / 6;    ///< shear coefficient kappa for a force along x
  double shear_y = 5.0 / 6;    ///< the same along y
  double reach_x_m = 0;        ///< distance of the outermost fibre along x; 0 if unknown: no stress
  double reach_y_m = 0;        ///< the same along y
  bool round = false;          ///< the outermost fibres lie on a circle rather than in corners
  double peak_shear_x_m2 = 0;  ///< largest shear stress = force along x / this area
  double peak_shear_y_m2 = 0;  ///< the same along y
};

/// Isotropic elastic material. Shear modulus G = E / (2 (1 + nu)).
struct Material {
  double youngs_modulus_Pa = 0;
  double poisson_ratio = 0;
  double density_kg_m3 = 0;
  std::optional<double> yield_strength_Pa{};  ///< if absent, stress is not compared with it

  double ShearModulus() const { return youngs_modulus_Pa / (2 * (1 + poisson_ratio)); }
};

/// Sections from their dimensions [m]. Dimensions must be positive and walls must fit inside; the
/// configuration reader checks this. Corners are sharp, without fillets.
///
/// Shear coefficients of round sections are Cowper's and depend on nu [Cowper, J. Appl. Mech. 33
/// (1966) 335]. The others follow from the strain energy of the shear flow,
///   1/kappa = (A / I^2) integral (Q/t)^2 dA,
/// which equals Cowper's value at nu = 0: 5/6 for a rectangle, 5/12 for a thin square tube. At
/// nu = 0.3 this overstates the shear part of a deflection by up to 5 %. Along x, the flanges of an
/// I-beam count as two rectangles.
///
/// The area for the peak shear stress is I t / Q at the neutral axis [Gere & Timoshenko, ch. 5].
Section RectangleSection(double b_m, double h_m);
Section SquareTubeSection(double side_m, double wall_m);
Section TubeSection(double outer_diameter_m, double wall_m, double poisson_ratio);
Section RodSection(double diameter_m, double poisson_ratio);
/// The strong axis is x: the web lies along y.
Section IBeamSection(double height_m, double width_m, double web_m, double flange_m);
/// From published moments. kappa = 5/6. The outermost fibre is unknown, so no stress is computed.
Section SectionFromMoments(double area_m2, double ix_m4, double iy_m4);

/// Looks up a material by name ("steel", "aluminium_6061", ...); nullopt if it is not listed. The
/// list with its sources is in materials.h.
std::optional<Material> MaterialByName(std::string_view name);

}  // namespace plumbline::model
