// Fuzzer: recognition of any bytes under any name. Every statement refers to a line of the file,
// and what is printed is harmless.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "app/base/recognition/outline.h"
#include "app/base/recognition/recognition.h"
#include "app/base/text/json_text.h"
#include "app/base/text/text.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plumbline;               // NOLINT(google-build-using-namespace)
  using namespace plumbline::recognition;  // NOLINT(google-build-using-namespace)
  constexpr const char* kNames[] = {"a",     "a.wrl", "a.stl", "a.yaml", "a.csv",
                                    "a.dat", "a.urp", "a.xls", "a.urdf", "a b.obj"};
  if (size == 0) return 0;
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast)
  const std::string_view bytes(reinterpret_cast<const char*>(data + 1), size - 1);
  const Recognition found = Recognise(bytes, kNames[*data % std::size(kNames)]);
  const Outline outline(bytes, "a");
  const int last =
      std::max({1, outline.line_count(), 1 + static_cast<int>(std::ranges::count(bytes, '\n'))});
  const auto check = [last](const Fact& fact) {
    if (fact.line < 0 || fact.line > last) std::abort();
  };
  check(found.evidence);
  std::ranges::for_each(found.facts, check);
  std::ranges::for_each(found.contradictions, check);
  if (found.name.empty() || (found.command.empty() && found.conversion.empty())) std::abort();
  const std::string text = TextOf(found);
  if (text::Visible(text) != text) std::abort();
  if (text::JsonOrNull(JsonOf({found})).is_null()) std::abort();
  return 0;
}
