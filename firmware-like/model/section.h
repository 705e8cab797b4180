// Cross-sections and materials of the tool beam.
#pragma once

#include <optional>
#include <string_view>

namespace plumbline {

/// A cross-section in the plane normal to the tool's z axis: x is its width, y its height.
/// `ix_m4` (about x) resists bending along y, `iy_m4` (about y) resists bending along x.
struct Section {
  double area_m2 = 0;
  double ix_m4 = 0;
  double iy_m4 = 0;
  double shear_x = 5.0 / 6;    ///< shear coefficient kappa of a force along x
  double shear_y = 5.0 / 6;    ///< likewise along y
  double reach_x_m = 0;        ///< outermost fibre from the axis along x; 0: not known, no stress
  double reach_y_m = 0;        ///< likewise along y
  bool round = false;          ///< the outermost fibres lie on a circle, not in corners
  double peak_shear_x_m2 = 0;  ///< largest shear stress = force along x / this area
  double peak_shear_y_m2 = 0;  ///< likewise along y
};

/// Elastic material. Shear modulus G = E / (2 (1 + nu)).
struct Material {
  double youngs_modulus_Pa = 0;
  double poisson_ratio = 0;
  double density_kg_m3 = 0;

  double ShearModulus() const { return youngs_modulus_Pa / (2 * (1 + poisson_ratio)); }
};

/// Sections by their dimensions [m]. Valid for positive dimensions whose walls fit inside; the
/// caller (the configuration) has checked that. Corners are sharp, without fillets.
///
/// Shear coefficients of the round sections are Cowper's, which depend on nu [Cowper, J. Appl.
/// Mech. 33 (1966) 335]. The others follow from the strain energy of the shear flow,
///   1/kappa = (A / I^2) integral (Q/t)^2 dA,
/// which is Cowper's value at nu = 0: 5/6 for a rectangle, 5/12 for a thin square tube. That
/// overstates the shear part of a deflection by up to 5 % at nu = 0.3. Along x, an I-beam's
/// flanges count as two rectangles.
///
/// The shear stress area is I t / Q at the neutral axis [Gere & Timoshenko, ch. 5].
Section RectangleSection(double b_m, double h_m);
Section SquareTubeSection(double side_m, double wall_m);
Section TubeSection(double outer_diameter_m, double wall_m, double poisson_ratio);
Section RodSection(double diameter_m, double poisson_ratio);
/// Strong axis x: the web stands along y.
Section IBeamSection(double height_m, double width_m, double web_m, double flange_m);
/// From published values; the outermost fibre is not known, so no stress is told. kappa = 5/6.
Section SectionFromMoments(double area_m2, double ix_m4, double iy_m4);

/// A material by its common name ("steel", "aluminium_6061", ...); nothing where it is not listed.
/// materials.h has the whole list with its sources.
std::optional<Material> MaterialByName(std::string_view name);

}  // namespace plumbline
