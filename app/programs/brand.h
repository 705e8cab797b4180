// A brand: the grammar of its programs, and how it writes numbers, orientations and postures.
//
// To add one, add a pair of files to app/programs/brands and a line to the table in brands.cc.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/programs/program.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/kinematics/chain.h"
#include "firmware-like/model/cell_model.h"
#include "firmware-like/result.h"

namespace plumbline::programs {

/// Digits of a number that replaces another.
struct NumberStyle {
  /// The least number of significant digits and of decimals; the digits of the old number
  /// otherwise. Without significant digits (0), only decimals count.
  int least_significant = 6;
  int least_decimals = 3;
  /// Write exactly `least_decimals` decimals, right-aligned in the width of the old number with its
  /// preceding blanks (FANUC).
  bool fixed = false;
  bool integers = false;  ///< whole numbers only (pulses)
  bool exponent = true;   ///< the language reads 1.2E-05
};

/// How a brand writes poses.
struct Conventions {
  double m_per_unit = 1e-3;
  /// Of the revolute joints of a joint target; prismatic ones are in `m_per_unit`.
  double rad_per_unit = kRadPerDeg;
  int orientation_numbers = 3;  ///< 3 angles or rotation vector, 4 for a quaternion
  NumberStyle length, angle;
  /// Whole turn by which an angle of the orientation may differ and be the same; 0: none.
  double turn = 0;
  /// Rotation of the numbers of an orientation; error text if they are no rotation (a quaternion of
  /// length 0).
  Result<Mat3> (*rotation)(std::span<const double> numbers) = nullptr;
  /// The numbers of R on the branch nearest to the old ones: neither a whole turn nor the other
  /// solution of the same angles nor the negative quaternion, unless nearer.
  std::vector<double> (*numbers)(const Mat3& R, std::span<const double> old) = nullptr;
};

/// A file that the reader refuses: encoded module, pulses without parameters. It stays identical.
struct Refusal {
  std::size_t file = 0;
  int line = 0;
  std::string what;    ///< what it is
  std::string remedy;  ///< what to give instead
};

struct Reading {
  Program program;
  std::vector<Refusal> refusals;
};

class Brand {
 public:
  virtual ~Brand() = default;

  virtual std::string_view name() const = 0;  ///< "KUKA KRL"
  virtual const Conventions& conventions() const = 0;

  /// True for a file of this brand, by name and first bytes.
  virtual bool Recognises(const SourceFile& file) const = 0;

  /// Reads all files of a program together. Pure; any bytes are accepted, and what is not
  /// understood becomes a remark, an untouchable point or a refusal.
  virtual Reading Read(std::vector<SourceFile> files) const = 0;

  /// Whether a posture agrees with what a point states; true if the point states nothing. Only the
  /// fields that a motion of this kind obeys count.
  virtual bool Agrees(const Configuration& stated, const kinematics::Chain& chain,
                      const model::JointVector& q, MotionKind kind) const = 0;

  /// The texts of the fields for a posture, in the order of `stated.fields`, each written as it
  /// was; equal to the old text if the posture has not left what it states.
  virtual std::vector<std::string> ConfigurationOf(const Configuration& stated,
                                                   const kinematics::Chain& chain,
                                                   const model::JointVector& q) const = 0;

  /// A comment line with the mark, including its line end, and where it is inserted in a file;
  /// nullopt if the language has no place for one. Read() finds it again as Program::marks.
  struct Insertion {
    std::size_t at = 0;
    std::string text;
  };
  virtual std::optional<Insertion> Mark(const SourceFile& file, std::string_view mark) const = 0;

  /// A linear or circular part of `motion` to a pose, in the style of the original statement and
  /// with its approximation, to be inserted before it; nullopt if this motion cannot be refined.
  /// @param numbers  x, y, z and the orientation in the units of the file
  /// @param part_m   length of each part; controllers that do not limit an approximation by
  ///                 themselves get one that fits
  virtual std::optional<std::string> InsertedMotion(const Program& program, const Motion& motion,
                                                    std::span<const double> numbers,
                                                    double part_m) const {
    (void)program, (void)motion, (void)numbers, (void)part_m;
    return std::nullopt;
  }
};

/// All brands, in the order in which they are asked to recognise a file.
std::span<const Brand* const> Brands();

/// The brand of a program: that of the files that any brand recognises. Files of two brands, or of
/// none, are an error that names them.
Result<const Brand*> BrandOf(const std::vector<SourceFile>& files,
                             std::span<const Brand* const> brands = Brands());

}  // namespace plumbline::programs
