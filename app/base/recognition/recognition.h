// Recognition of a file from its bytes and its name: what it is, and what can be done with it.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace plumbline::recognition {

/// What a file holds, whatever its format. Commands state which of these they read.
enum class Content {
  kUnknown,
  kCell,
  kConfiguration,  ///< plumbline.toml
  kRobotProfile,   ///< of a controller
  kZoomProfile,
  kTags,     ///< bodies.toml
  kObjects,  ///< objects.toml
  kLens,
  kLensOfOthers,  ///< a lens in a form that no command reads
  kHandEye,
  kDiagnosis,
  kState,        ///< of the daemon: databases and state.json
  kMapping,      ///< of columns, written by import
  kDescription,  ///< URDF
  kKinematics,   ///< factory table of an arm
  kKinematicsOfOthers,
  kMeasured,  ///< measured.csv or test_poses.csv
  kPoses,     ///< robot poses, one per image
  kTable,     ///< any other table of numbers
  kExport,    ///< of an instrument or controller: a table that import turns into measured.csv
  kCalibrationResult,  ///< of robot_calibration
  kMesh,
  kMeshOfOthers,  ///< a model or mesh that no command reads
  kProgram,       ///< of a robot controller
  kBoard,         ///< description of a board or of tags
  kImage,
  kDocument,   ///< spreadsheet, PDF, web page
  kContainer,  ///< archive or compressed file
  kRecording,  ///< bag file
  kEmpty,
};

/// How sure the kind is.
enum class Certainty {
  kShown,      ///< the content shows it, and only this kind has that
  kName,       ///< only the name of the file says so
  kUndecided,  ///< several kinds look like this
  kUnknown,
};

/// Something that the file shows.
struct Fact {
  std::string what;   ///< "image size"
  std::string value;  ///< "640 x 480 px"
  int line = 0;       ///< that shows it, from 1; 0: the file as a whole, or its name
};

struct Recognition {
  std::string file;
  std::string kind;  ///< stable word: "ros-camera-info"
  std::string name;  ///< for people: "lens file of ROS (camera_info)"
  Content content = Content::kUnknown;
  Certainty certainty = Certainty::kUnknown;
  Fact evidence;                        ///< what shows the kind
  std::vector<std::string> candidates;  ///< names of the kinds between which it is undecided
  std::vector<Fact> facts;              ///< format, version, units, conventions, counts
  std::vector<Fact> contradictions;     ///< `value` says what contradicts what
  std::vector<std::string> undecided;   ///< what the file does not show, and must be stated
  std::string command;                  ///< that uses the file; empty: none does
  std::string conversion;               ///< into what to convert it and how; empty: not needed
};

/// Pure; any bytes. Takes time proportional to the size.
/// @param name  of the file
Recognition Recognise(std::string_view bytes, std::string_view name);

/// For people, several lines.
std::string TextOf(const Recognition& recognition);
/// A JSON object, indented.
std::string JsonOf(const std::vector<Recognition>& files);

}  // namespace plumbline::recognition
