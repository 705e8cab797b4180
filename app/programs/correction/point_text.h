// A point between its numbers in the file and its pose.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/programs/brand.h"
#include "app/programs/correction/number_text.h"

namespace plumbline::programs {

/// Whether a point states x, y and z, but no orientation.
bool StatesPositionAlone(const Point& point);

/// The pose of a point in its base [m], or why its numbers are none.
/// @param orientation  of a point that states a position alone; absent: such a point has no pose
Result<Pose> PoseOf(const Point& point, const Conventions& conventions,
                    const std::optional<Mat3>& orientation = {});

/// The same from numbers x, y, z and orientation, which must be a rotation.
Pose PoseFromNumbers(std::span<const double> numbers, const Conventions& conventions);

/// Numbers x, y, z and orientation of a pose, on the branch nearest to those of a point; nullopt if
/// the point lacks some.
std::optional<std::vector<double>> NumbersOfPose(const Pose& X_UP, const Point& like,
                                                 const Conventions& conventions);

/// The texts of a corrected point.
struct PointText {
  std::vector<Edit> edits;  ///< of the numbers whose text changes
  Pose written;             ///< the pose of the texts, rounded as they are
  std::string problem;      ///< not empty: why it cannot be written
};

/// @param taught     the pose of the numbers in the file
/// @param corrected  the pose to be written; an orientation that does not change stays as written,
///                   and one that is not written is not added
PointText TextOf(const Point& point, const Pose& taught, const Pose& corrected,
                 const Conventions& conventions, const std::vector<SourceFile>& files);

/// Adds an edit unless it leaves the bytes as they are.
void AddIfChanged(std::string_view bytes, Edit edit, std::vector<Edit>& edits);

std::string_view TrimmedBlanks(std::string_view text);

}  // namespace plumbline::programs
