// Refusal of files that are certainly of another kind than the one that is read.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

#include "app/base/config/fault.h"
#include "app/base/recognition/recognition.h"

namespace plumbline::config {

/// What a reader reads.
struct Wanted {
  const char* words;  ///< "a cell (cell.toml)"
  std::initializer_list<recognition::Content> contents;
};

inline constexpr Wanted kWantedCell{"a cell (cell.toml)", {recognition::Content::kCell}};
inline constexpr Wanted kWantedConfiguration{"the daemon's configuration (plumbline.toml)",
                                             {recognition::Content::kConfiguration}};
inline constexpr Wanted kWantedRobotProfile{"a register profile of a robot controller",
                                            {recognition::Content::kRobotProfile}};
inline constexpr Wanted kWantedZoomProfile{"a profile of a zoom lens",
                                           {recognition::Content::kZoomProfile}};
inline constexpr Wanted kWantedTags{"tags and bodies (bodies.toml)", {recognition::Content::kTags}};
inline constexpr Wanted kWantedObjects{"a table of virtual objects (objects.toml)",
                                       {recognition::Content::kObjects}};
inline constexpr Wanted kWantedLens{"a lens file (LENS.json, or one of OpenCV, ROS or ARToolKit)",
                                    {recognition::Content::kLens}};
inline constexpr Wanted kWantedMeasured{
    "a table of measured points (measured.csv)",
    {recognition::Content::kMeasured, recognition::Content::kPoses, recognition::Content::kTable}};
inline constexpr Wanted kWantedPostures{
    "a table of postures (test_poses.csv)",
    {recognition::Content::kMeasured, recognition::Content::kPoses, recognition::Content::kTable}};
inline constexpr Wanted kWantedPoses{"robot poses, one per image (CSV)",
                                     {recognition::Content::kPoses, recognition::Content::kMeasured,
                                      recognition::Content::kTable, recognition::Content::kExport}};
inline constexpr Wanted kWantedTable{
    "a table of measured points or joints",
    {recognition::Content::kTable, recognition::Content::kExport, recognition::Content::kMeasured,
     recognition::Content::kPoses, recognition::Content::kCalibrationResult}};
inline constexpr Wanted kWantedArm{
    "a URDF, or the factory table of an arm (kinematics.yaml)",
    {recognition::Content::kDescription, recognition::Content::kKinematics}};
inline constexpr Wanted kWantedUrdf{"a URDF", {recognition::Content::kDescription}};
inline constexpr Wanted kWantedMapping{"a mapping of columns (TOML)",
                                       {recognition::Content::kMapping}};
inline constexpr Wanted kWantedImage{"an image", {recognition::Content::kImage}};
inline constexpr Wanted kWantedImageFolder{"a folder of images", {}};
inline constexpr Wanted kWantedMesh{"a mesh (VRML97, STL, OBJ, PLY, glTF)",
                                    {recognition::Content::kMesh}};

inline constexpr std::size_t kRecognisedBytes = 256 * 1024;

/// Adds a fault if the content shows another kind: "is recognised as X (..), but Y is read here.
/// Use `plumbline ..`", with the line that shows it. A file whose kind is not certain, or that is
/// damaged but of the right kind, is left to its reader, except a mesh whose name selects another
/// reader. Only the first kRecognisedBytes are inspected.
/// @return  true if the file was refused
bool RefuseWrongFile(std::string_view bytes, const std::string& file, const Wanted& wanted,
                     FaultList& faults);

}  // namespace plumbline::config
