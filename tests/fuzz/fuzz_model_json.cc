// Fuzzer: arbitrary text as the JSON files of the model store and as a diagnosis: rejected, or
// values that survive writing and reading.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "app/cell/model_store/model_json.h"

namespace {

using namespace plumbline;  // NOLINT(google-build-using-namespace)

void Require(bool condition) {
  if (!condition) std::abort();
}

void WrittenAndReadAgain(const cell::ModelFacts& facts) {
  const std::string written = cell::JsonFrom(facts);
  const auto again = cell::ModelFactsFromJson(written);
  Require(again && cell::JsonFrom(*again) == written &&
          cell::SchemaInJson(written) == cell::kModelSchema);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  static_cast<void>(cell::SchemaInJson(text));
  if (const auto facts = cell::ModelFactsFromJson(text)) WrittenAndReadAgain(*facts);
  if (const auto state = cell::ModelStateFromJson(text)) {
    Require(cell::ModelStateFromJson(cell::JsonFrom(*state)) == *state);
  }
  const auto diagnosed = cell::ModelFactsFromDiagnosis(text);
  if (diagnosed) {
    WrittenAndReadAgain(*diagnosed);
  } else {
    Require(!diagnosed.error().empty());
  }
  return 0;
}
