// Interpreter of the part of URScript that plumbline_rtde.script uses.
//
// Functions, threads, while, if/elif/else, return, local and global variables, lists and poses with
// indices, arithmetic, comparison, and/or/not. Anything else is an error with its line. sync() ends
// a step of the controller: the interpreter calls back, and goes on when the callback returns.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/virtual_ur/rtde_server.h"

namespace virtual_ur {

struct Value {
  enum class Kind { kNumber, kBool, kList, kPose };
  Kind kind = Kind::kNumber;
  double number = 0;         ///< of kNumber and kBool
  std::vector<Value> items;  ///< of kList, and the six numbers of kPose

  static Value Number(double value) { return {Kind::kNumber, value, {}}; }
  static Value Bool(bool value) { return {Kind::kBool, value ? 1.0 : 0.0, {}}; }
  static Value Pose(const std::array<double, 6>& p);
  std::array<double, 6> AsPose() const;  ///< @throws ScriptError if it is none
};

struct ScriptError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Script {
 public:
  /// @param registers  source of read_input_.. @throws ScriptError with the line
  Script(const std::string& text, const UrState& registers);
  ~Script();

  /// Runs a thread until `on_sync` throws.
  void RunThread(const std::string& name, std::function<void()> on_sync);
  /// Calls a function; may be used in `on_sync`.
  Value Call(const std::string& name, const std::vector<Value>& arguments);
  Value Global(const std::string& name) const;
  void SetGlobal(const std::string& name, Value value);

 private:
  struct Parser;
  struct Node;
  struct Function;
  struct Frame;
  using NodePtr = std::unique_ptr<Node>;

  bool Execute(const std::vector<NodePtr>& body, Frame& frame);
  bool Execute(const Node& node, Frame& frame);
  void Assign(const Node& target, bool local, bool global, Value value, Frame& frame);
  Value Evaluate(const Node& node, Frame& frame);
  Value CallNamed(const Node& node, Frame& frame);
  Value& Variable(const std::string& name, Frame& frame, int line);

  const UrState& registers_;
  std::map<std::string, Function> functions_;
  std::map<std::string, Value> globals_;
  std::function<void()> on_sync_;
};

}  // namespace virtual_ur
