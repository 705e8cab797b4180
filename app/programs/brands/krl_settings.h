// Tools, bases and loads of a KRL program.
//
// What BAS() does is that of the module bas.src which every controller has: TOOL(n) sets $TOOL and
// $LOAD, BASE(n) sets $BASE, FRAMES() does both for FDAT_ACT, with external axes by MACHINE_DEF.
#pragma once

#include <string>
#include <unordered_map>

#include "app/programs/brands/krl_names.h"

namespace plumbline::programs::krl {

/// The tool, base and load that a frame record (FDAT) or BAS() sets.
struct Frames {
  std::optional<Setting> tool, base, load;
  std::optional<std::string> stationary;  ///< not empty: the tool is stationary (#TCP); empty: not
};

class Settings {
 public:
  /// Fills the tables of the program with TOOL_DATA, BASE_DATA and LOAD_DATA.
  Settings(Reading& reading, Names& names);

  /// Settings of the tool, base or load with a number; nullopt: the number is not constant.
  Setting Tool(std::optional<std::int64_t> number) const;
  Setting Base(std::optional<std::int64_t> number) const;
  Setting Load(std::optional<std::int64_t> number) const;
  /// Those of a frame record; all unknown for another expression.
  Frames FramesOf(const Reference& record) const;

  /// Those of a function of the inline forms, at the token `begin`: STOOL2(FP1),
  /// SBASE(FP1.BASE_NO), SLOAD(3); nullopt if another expression stands there.
  std::optional<Frames> FunctionFrames(const Statement& statement, std::size_t module,
                                       std::optional<std::size_t> routine, std::size_t begin) const;

  /// The frame or load that an expression of the tokens [begin, end) gives; a literal and a
  /// constant variable are added to the table.
  Setting Frame(const Statement& statement, std::size_t module, std::optional<std::size_t> routine,
                std::size_t begin, std::size_t end, bool base);
  Setting LoadIn(const Statement& statement, std::size_t module, std::optional<std::size_t> routine,
                 std::size_t begin, std::size_t end);

  /// The pose that an operand of the geometric operator has all the time.
  /// @param why  why it has none
  std::optional<Pose> Constant(const Statement& statement, std::size_t module,
                               std::optional<std::size_t> routine, std::size_t begin,
                               std::size_t end, std::string& why) const;

 private:
  void ReadFrames(std::string_view name, bool base);
  void ReadLoads();
  std::string ExternalAxis(std::int64_t base) const;
  std::string Correction() const;
  std::string WrittenAt(std::string_view name, const std::string& path) const;
  std::optional<std::int64_t> WholeNumberAt(const Reference& record, std::string_view member) const;

  Reading& reading_;
  Names& names_;
  Pose X_root_;  ///< $ROBROOT: the robot's base frame in the world frame [m]
  std::string root_changes_;
  std::string correction_;
  std::unordered_map<std::string, std::string> load_changes_;
};

}  // namespace plumbline::programs::krl
