#include <string_view>
#include <type_traits>

#include "app/cell/scene/interference.h"

/// The only function of the module, see plumbline::cell::MakeInterference.
extern "C" __attribute__((visibility("default"))) plumbline::cell::Interference*
plumbline_make_interference_1() {
  return new plumbline::cell::Interference();
}

// The programs look this function up by name.
static_assert(std::string_view(plumbline::cell::kMakeInterferenceName) ==
              "plumbline_make_interference_1");
static_assert(
    std::is_same_v<decltype(plumbline_make_interference_1), plumbline::cell::MakeInterference>);
