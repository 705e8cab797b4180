// Fuzzer: arbitrary text as the JSON files of the model store and as a diagnosis: rejected, or
// values that survive writing and reading.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "app/model_store/model_json.h"

namespace {

using namespace plumbline;  // NOLINT(google-build-using-namespace)

void Require(bool condition) {
  if (!condition) std::abort();
}

void WrittenAndReadAgain(const ModelFacts& facts) {
  const std::string written = JsonFrom(facts);
  const auto again = ModelFactsFromJson(written);
  Require(again && JsonFrom(*again) == written && SchemaInJson(written) == kModelSchema);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  static_cast<void>(SchemaInJson(text));
  if (const auto facts = ModelFactsFromJson(text)) WrittenAndReadAgain(*facts);
  if (const auto state = ModelStateFromJson(text)) {
    Require(ModelStateFromJson(JsonFrom(*state)) == *state);
  }
  const auto diagnosed = ModelFactsFromDiagnosis(text);
  if (diagnosed) {
    WrittenAndReadAgain(*diagnosed);
  } else {
    Require(!diagnosed.error().empty());
  }
  return 0;
}
