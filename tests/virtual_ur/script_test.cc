#include "tests/virtual_ur/script.h"

#include <catch2/catch.hpp>
#include <cmath>

namespace virtual_ur {

TEST_CASE("the interpreter computes what URScript does") {
  UrState registers;
  registers.input_int[5] = 7;
  registers.input_double[3] = 0.25;
  Script script(R"(
global total = 0
global list = [1, 2.5, 3]
def add(a, b):
  local sum = a + b * 2
  total = total + sum    # a global that exists
  hidden = 9             # no global of that name: local
  return sum
end
def classify(x):
  if x < 0:
    return -1
  elif x == 0:
    return 0
  else:
    return 1
  end
end
def count():
  local k = 0
  while k < 10 and not (k == 4):
    list[1] = k
    k = k + 1
  end
  return read_input_integer_register(5) + read_input_float_register(3)
end
)",
                registers);
  CHECK(script.Call("add", {Value::Number(1), Value::Number(2)}).number == 5);
  CHECK(script.Global("total").number == 5);
  CHECK_THROWS_AS(script.Global("hidden"), ScriptError);
  CHECK(script.Call("classify", {Value::Number(-3)}).number == -1);
  CHECK(script.Call("classify", {Value::Number(0)}).number == 0);
  CHECK(script.Call("classify", {Value::Number(3)}).number == 1);
  CHECK(script.Call("count", {}).number == 7.25);
  CHECK(script.Global("list").items[1].number == 3);
}

TEST_CASE("poses are interpolated along a straight line and about one axis") {
  const UrState registers;
  Script script(R"(
def half(a, b):
  return interpolate_pose(a, b, 0.5)
end
def back(a):
  return pose_trans(pose_inv(a), a)
end
)",
                registers);
  const Value a = Value::Pose({0, 0, 0, 0, 0, 0}), b = Value::Pose({1, 2, 3, 0, 0, 1});
  const auto half = script.Call("half", {a, b}).AsPose();
  CHECK(half[1] == 1);
  CHECK(half[5] == Approx(0.5));
  for (const double part : script.Call("back", {b}).AsPose()) CHECK(std::abs(part) < 1e-15);
}

TEST_CASE("what the interpreter does not know is an error with its line") {
  const UrState registers;
  CHECK_THROWS_WITH(Script("global a = 1\nglobal b = movej(a)\n", registers),
                    Catch::Contains("line 2") && Catch::Contains("movej"));
  CHECK_THROWS_WITH(Script("def f():\n  return 1\n", registers), Catch::Contains("line"));
  Script script("def f():\n  return list[3]\nend\nglobal list = [1]\n", registers);
  CHECK_THROWS_WITH(script.Call("f", {}), Catch::Contains("outside the list"));
}

}  // namespace virtual_ur
