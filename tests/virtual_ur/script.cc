#include "tests/virtual_ur/script.h"

#include <cctype>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <utility>

#include "tests/virtual_cell/rigid_motion.h"

namespace virtual_ur {
namespace {

using virtual_cell::Motion;
using virtual_cell::Vec3;

[[noreturn]] void Throw(int line, const std::string& what) {
  throw ScriptError("line " + std::to_string(line) + ": " + what);
}

Motion MotionOf(const Value& pose) {
  const auto p = pose.AsPose();
  return virtual_cell::MotionFromXyzVector({p[0], p[1], p[2]}, {p[3], p[4], p[5]});
}

Value PoseOf(const Motion& X) {
  const Vec3 r = virtual_cell::VectorFromRotation(X.linear());
  const Vec3 p = X.translation();
  return Value::Pose({p.x(), p.y(), p.z(), r.x(), r.y(), r.z()});
}

/// Straight line of the position, constant axis of the rotation.
Value Interpolated(const Value& from, const Value& to, double share) {
  const Motion a = MotionOf(from), b = MotionOf(to);
  const Vec3 turn = virtual_cell::VectorFromRotation(a.linear().transpose() * b.linear());
  Motion X = Motion::Identity();
  X.linear() = a.linear() * virtual_cell::RotationFromVector(share * turn);
  X.translation() = a.translation() + share * (b.translation() - a.translation());
  return PoseOf(X);
}

}  // namespace

Value Value::Pose(const std::array<double, 6>& p) {
  Value pose{Kind::kPose, 0, {}};
  for (const double value : p) pose.items.push_back(Number(value));
  return pose;
}

std::array<double, 6> Value::AsPose() const {
  if (kind != Kind::kPose) throw ScriptError("a pose is needed");
  std::array<double, 6> p{};
  for (std::size_t k = 0; k < 6; ++k) p[k] = items[k].number;
  return p;
}

struct Script::Node {
  /// "number", "name", "list", "pose", "call", "index", an operator; "assign", "while", "if",
  /// "return", "expression".
  std::string kind;
  int line = 0;
  std::string name;  ///< of a name or call; "local" or "global" of an assignment
  double number = 0;
  std::vector<NodePtr> parts;                ///< operands; condition; target and value
  std::vector<std::vector<NodePtr>> bodies;  ///< of while and of each branch
};

struct Script::Function {
  std::vector<std::string> parameters;
  std::vector<NodePtr> body;
};

struct Script::Frame {
  std::map<std::string, Value> locals;
  Value result = Value::Bool(false);
};

struct Script::Parser {
  struct Token {
    std::string text;
    int line;
  };
  std::vector<Token> tokens;
  std::size_t at = 0;

  explicit Parser(const std::string& text) {
    int line = 1;
    for (std::size_t k = 0; k < text.size();) {
      const char c = text[k];
      if (c == '\n') {
        tokens.push_back({"\n", line++});
        ++k;
      } else if (c == '#') {
        while (k < text.size() && text[k] != '\n') ++k;
      } else if (std::isspace(static_cast<unsigned char>(c)) != 0) {
        ++k;
      } else if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_') {
        std::size_t end = k;
        while (end < text.size() && (std::isalnum(static_cast<unsigned char>(text[end])) != 0 ||
                                     text[end] == '_' || text[end] == '.')) {
          ++end;
        }
        tokens.push_back({text.substr(k, end - k), line});
        k = end;
      } else {
        static const std::string kPairs = "== != <= >=";
        const std::string two = text.substr(k, 2);
        const bool pair = two.size() == 2 && two[1] == '=' && kPairs.find(two) != std::string::npos;
        tokens.push_back({pair ? two : std::string(1, c), line});
        k += pair ? 2 : 1;
      }
    }
    tokens.push_back({"\n", line});
    tokens.push_back({"", line});
  }

  const std::string& Peek() const { return tokens[at].text; }
  int Line() const { return tokens[at].line; }
  bool Take(const std::string& text) {
    if (Peek() != text) return false;
    ++at;
    return true;
  }
  void Need(const std::string& text) {
    if (!Take(text)) Throw(Line(), "'" + (text == "\n" ? "end of line" : text) + "' is expected");
  }
  std::string Word() {
    const std::string word = Peek();
    if (word.empty() || (std::isalpha(static_cast<unsigned char>(word[0])) == 0 && word[0] != '_'))
      Throw(Line(), "a name is expected");
    ++at;
    return word;
  }
  void SkipLines() {
    while (Take("\n")) {
    }
  }
  NodePtr Make(const std::string& kind) const {
    auto node = std::make_unique<Node>();
    node->kind = kind;
    node->line = Line();
    return node;
  }

  /// Statements up to one of the words that end them, which is not taken.
  std::vector<NodePtr> Body() {
    std::vector<NodePtr> body;
    Need("\n");
    SkipLines();
    while (Peek() != "end" && Peek() != "else" && Peek() != "elif") {
      body.push_back(Statement());
      SkipLines();
    }
    return body;
  }

  NodePtr Statement() {
    NodePtr node = Make("expression");
    if (Take("while")) {
      node->kind = "while";
      node->parts.push_back(Expression());
      Need(":");
      node->bodies.push_back(Body());
      Need("end");
    } else if (Take("if")) {
      node->kind = "if";
      do {
        node->parts.push_back(Expression());
        Need(":");
        node->bodies.push_back(Body());
      } while (Take("elif"));
      if (Take("else")) {
        Need(":");
        node->bodies.push_back(Body());
      }
      Need("end");
    } else if (Take("return")) {
      node->kind = "return";
      node->parts.push_back(Expression());
    } else {
      if (Peek() == "local" || Peek() == "global") node->name = Word();
      node->parts.push_back(Expression());
      if (Take("=")) {
        node->kind = "assign";
        node->parts.push_back(Expression());
      }
    }
    Need("\n");
    return node;
  }

  NodePtr Binary(int level) {
    static const std::vector<std::vector<std::string>> kLevels = {
        {"or"}, {"and"}, {"==", "!=", "<", ">", "<=", ">="}, {"+", "-"}, {"*", "/"}};
    if (level == static_cast<int>(kLevels.size())) return Unary();
    NodePtr left = Binary(level + 1);
    while (true) {
      std::string found;
      for (const std::string& word : kLevels[static_cast<std::size_t>(level)]) {
        if (Peek() == word) found = word;
      }
      if (found.empty()) return left;
      NodePtr node = Make(found);
      ++at;
      node->parts.push_back(std::move(left));
      node->parts.push_back(Binary(level + 1));
      left = std::move(node);
    }
  }
  NodePtr Expression() { return Binary(0); }

  NodePtr Unary() {
    if (Peek() != "-" && Peek() != "not") return Postfix();
    NodePtr node = Make(Peek() == "-" ? "negative" : "not");
    ++at;
    node->parts.push_back(Unary());
    return node;
  }

  void List(std::vector<NodePtr>& parts, const std::string& end) {
    if (Take(end)) return;
    do {
      parts.push_back(Expression());
    } while (Take(","));
    Need(end);
  }

  NodePtr Postfix() {
    NodePtr node = Primary();
    while (Peek() == "[") {
      NodePtr index = Make("index");
      ++at;
      index->parts.push_back(std::move(node));
      index->parts.push_back(Expression());
      Need("]");
      node = std::move(index);
    }
    return node;
  }

  NodePtr Primary() {
    NodePtr node = Make("number");
    if (Take("(")) {
      node = Expression();
      Need(")");
      return node;
    }
    if (Take("[")) {
      node->kind = "list";
      List(node->parts, "]");
      return node;
    }
    if (!Peek().empty() && std::isdigit(static_cast<unsigned char>(Peek()[0])) != 0) {
      node->number = std::strtod(Peek().c_str(), nullptr);
      ++at;
      return node;
    }
    node->name = Word();
    node->kind = "name";
    if (node->name == "p" && Take("[")) {
      node->kind = "pose";
      List(node->parts, "]");
      if (node->parts.size() != 6) Throw(node->line, "a pose has six numbers");
    } else if (Take("(")) {
      node->kind = "call";
      List(node->parts, ")");
    }
    return node;
  }
};

Script::Script(const std::string& text, const UrState& registers) : registers_(registers) {
  Parser parser(text);
  Frame top;
  for (parser.SkipLines(); !parser.Peek().empty(); parser.SkipLines()) {
    if (parser.Take("def") || parser.Take("thread")) {
      const std::string name = parser.Word();
      Function function;
      parser.Need("(");
      if (!parser.Take(")")) {
        do {
          function.parameters.push_back(parser.Word());
        } while (parser.Take(","));
        parser.Need(")");
      }
      parser.Need(":");
      function.body = parser.Body();
      parser.Need("end");
      functions_[name] = std::move(function);
    } else {
      Execute(*parser.Statement(), top);
    }
  }
}

Script::~Script() = default;

void Script::RunThread(const std::string& name, std::function<void()> on_sync) {
  on_sync_ = std::move(on_sync);
  Call(name, {});
}

Value Script::Call(const std::string& name, const std::vector<Value>& arguments) {
  const auto function = functions_.find(name);
  if (function == functions_.end()) throw ScriptError("no function " + name);
  if (function->second.parameters.size() != arguments.size())
    throw ScriptError(name + " takes " + std::to_string(function->second.parameters.size()));
  Frame frame;
  for (std::size_t k = 0; k < arguments.size(); ++k) {
    frame.locals[function->second.parameters[k]] = arguments[k];
  }
  Execute(function->second.body, frame);
  return frame.result;
}

Value Script::Global(const std::string& name) const {
  const auto found = globals_.find(name);
  if (found == globals_.end()) throw ScriptError("no global variable " + name);
  return found->second;
}

void Script::SetGlobal(const std::string& name, Value value) {
  globals_[name] = std::move(value);
}

/// @return  true after `return`
bool Script::Execute(const std::vector<NodePtr>& body, Frame& frame) {
  for (const NodePtr& node : body) {
    if (Execute(*node, frame)) return true;
  }
  return false;
}

bool Script::Execute(const Node& node, Frame& frame) {
  if (node.kind == "while") {
    while (Evaluate(*node.parts[0], frame).number != 0) {
      if (Execute(node.bodies[0], frame)) return true;
    }
    return false;
  }
  if (node.kind == "if") {
    for (std::size_t k = 0; k < node.bodies.size(); ++k) {
      if (k < node.parts.size() && Evaluate(*node.parts[k], frame).number == 0) continue;
      return Execute(node.bodies[k], frame);
    }
    return false;
  }
  if (node.kind == "return") {
    frame.result = Evaluate(*node.parts[0], frame);
    return true;
  }
  if (node.kind == "assign") {
    Assign(*node.parts[0], node.name == "local", node.name == "global",
           Evaluate(*node.parts[1], frame), frame);
    return false;
  }
  Evaluate(*node.parts[0], frame);
  return false;
}

void Script::Assign(const Node& target, bool local, bool global, Value value, Frame& frame) {
  if (target.kind == "index") {
    const double index = Evaluate(*target.parts[1], frame).number;
    Value& list = Variable(target.parts[0]->name, frame, target.line);
    if (index < 0 || index >= static_cast<double>(list.items.size()))
      Throw(target.line, "index outside the list");
    list.items[static_cast<std::size_t>(index)] = std::move(value);
    return;
  }
  if (target.kind != "name") Throw(target.line, "this cannot be assigned to");
  const bool is_global =
      !local &&
      (global || (frame.locals.count(target.name) == 0 && globals_.count(target.name) != 0));
  (is_global ? globals_ : frame.locals)[target.name] = std::move(value);
}

Value& Script::Variable(const std::string& name, Frame& frame, int line) {
  if (const auto local = frame.locals.find(name); local != frame.locals.end()) return local->second;
  const auto global = globals_.find(name);
  if (global == globals_.end()) Throw(line, "no variable " + name);
  return global->second;
}

Value Script::Evaluate(const Node& node, Frame& frame) {
  if (node.kind == "number") return Value::Number(node.number);
  if (node.kind == "name") {
    if (node.name == "True" || node.name == "False") return Value::Bool(node.name == "True");
    return Variable(node.name, frame, node.line);
  }
  if (node.kind == "call") return CallNamed(node, frame);
  if (node.kind == "and" || node.kind == "or") {
    const bool left = Evaluate(*node.parts[0], frame).number != 0;
    if (left != (node.kind == "and")) return Value::Bool(left);
    return Value::Bool(Evaluate(*node.parts[1], frame).number != 0);
  }
  std::vector<Value> parts;
  for (const NodePtr& part : node.parts) parts.push_back(Evaluate(*part, frame));
  if (node.kind == "list") return {Value::Kind::kList, 0, std::move(parts)};
  if (node.kind == "pose") return {Value::Kind::kPose, 0, std::move(parts)};
  if (node.kind == "index") {
    const double index = parts[1].number;
    if (index < 0 || index >= static_cast<double>(parts[0].items.size()))
      Throw(node.line, "index outside the list");
    return parts[0].items[static_cast<std::size_t>(index)];
  }
  for (const Value& part : parts) {
    if (!part.items.empty()) Throw(node.line, "'" + node.kind + "' is for numbers");
  }
  const double a = parts[0].number;
  if (node.kind == "negative") return Value::Number(-a);
  if (node.kind == "not") return Value::Bool(a == 0);
  const double b = parts[1].number;
  if (node.kind == "+") return Value::Number(a + b);
  if (node.kind == "-") return Value::Number(a - b);
  if (node.kind == "*") return Value::Number(a * b);
  if (node.kind == "/") {
    if (b == 0) Throw(node.line, "division by zero");
    return Value::Number(a / b);
  }
  if (node.kind == "==") return Value::Bool(a == b);
  if (node.kind == "!=") return Value::Bool(a != b);
  if (node.kind == "<") return Value::Bool(a < b);
  if (node.kind == ">") return Value::Bool(a > b);
  if (node.kind == "<=") return Value::Bool(a <= b);
  return Value::Bool(a >= b);
}

Value Script::CallNamed(const Node& node, Frame& frame) {
  std::vector<Value> parts;
  for (const NodePtr& part : node.parts) parts.push_back(Evaluate(*part, frame));
  const auto need = [&](std::size_t count) {
    if (parts.size() != count) Throw(node.line, node.name + " has other arguments");
  };
  const std::string& name = node.name;
  if (functions_.count(name) != 0) return Call(name, parts);
  const auto number = [&] {
    need(1);
    const double index = parts[0].number;
    if (!(index >= 0 && index < 48)) Throw(node.line, "register outside 0..47");
    return static_cast<std::size_t>(index);
  };
  if (name == "read_input_integer_register") return Value::Number(registers_.input_int[number()]);
  if (name == "read_input_float_register") return Value::Number(registers_.input_double[number()]);
  if (name == "sync") {
    need(0);
    if (on_sync_) on_sync_();
    return Value::Bool(true);
  }
  if (name == "get_steptime") return Value::Number(RtdeServer::kCycle_s);
  if (name == "point_dist") {
    need(2);
    return Value::Number(
        (MotionOf(parts[0]).translation() - MotionOf(parts[1]).translation()).norm());
  }
  if (name == "interpolate_pose") {
    need(3);
    return Interpolated(parts[0], parts[1], parts[2].number);
  }
  if (name == "pose_trans") {
    need(2);
    return PoseOf(MotionOf(parts[0]) * MotionOf(parts[1]));
  }
  if (name == "pose_inv") {
    need(1);
    return PoseOf(MotionOf(parts[0]).inverse());
  }
  if (name == "norm") {
    need(1);
    double sum = 0;
    for (const Value& item : parts[0].items) sum += item.number * item.number;
    return Value::Number(std::sqrt(sum));
  }
  Throw(node.line, "no function " + name);
}

}  // namespace virtual_ur
