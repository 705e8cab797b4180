// Steps of a Yaskawa job from its instructions.
#pragma once

#include <map>
#include <string>

#include "app/programs/brands/source_cursor.h"
#include "app/programs/program.h"

namespace plumbline::programs::jbi {

/// What a motion takes from the header of its point.
struct PointHeader {
  std::size_t point = 0;  ///< index in Program::points
  Setting tool, base;
};
using PointHeaders = std::map<long, PointHeader>;  ///< by the number of C

/// Reads one instruction line of //INST.
class InstructionReader {
 public:
  InstructionReader(const PointHeaders& points, Program& program, Routine& routine)
      : points_(points), program_(program), routine_(routine) {}

  void Read(std::string_view line, Place place, Span span);
  void Finish();

 private:
  struct Block {
    std::string otherwise, end, top;
    bool cases = false;
  };

  Step& Add(StepKind kind);
  std::string NewLabel();
  void Conditional(std::string_view line, StepKind kind, std::string label);
  void Move(std::string_view word, std::string_view line, Span span);
  bool Structure(std::string_view word);
  void Uses(std::string_view line);

  const PointHeaders& points_;
  Program& program_;
  Routine& routine_;
  Place place_;
  int last_label_ = 0;
  std::vector<Block> blocks_;
};

/// `C00012`: 12.
std::optional<long> PointNumber(std::string_view word);

}  // namespace plumbline::programs::jbi
