// Options by which a user states what a robot program does not contain: tools, bases, loads.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/programs/correction/program_correction.h"
#include "firmware-like/result.h"

namespace plumbline::cli {

/// The texts of the options, as given.
struct StatedTexts {
  std::vector<std::string> tools, bases, loads, starts, routines;
  std::string frames;  ///< path of a file; empty: none
};

/// A payload from "KG" or "KG,X,Y,Z" in mm.
std::optional<programs::StatedPayload> PayloadFromText(const std::string& text);

/// Joints from "Q1,Q2,..", in degrees or mm, with a value for each joint of the robot.
std::optional<model::JointVector> JointsFromText(const std::string& text,
                                                 const model::Robot& robot);

/// Parses the options and the frames file. Bases and tools get into the program's own tables, where
/// they replace what the files state; all else into the settings.
///
/// --frames: `[tool."KEY"]` with number, pose, load_kg, cog_mm; `[base."KEY"]` with pose;
/// `[load."KEY"]` with payload_kg, cog_mm. A pose is x, y, z and the orientation as the
/// controller's files have them; a tool without one whose values are in no file of the program has
/// its tool point at the tip of the cell's tool.
///
/// A key of an option that no line of the program uses is an error, which names the nearest one
/// that is used. In the file, which may serve many programs, it is printed as a note.
Result<void> ApplyStated(const StatedTexts& texts, const programs::Brand& brand,
                         const model::CellModel& cell, programs::Program& program,
                         programs::CorrectionSettings& settings);

}  // namespace plumbline::cli
