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

void WrittenAndReadAgain(const model_store::ModelFacts& facts) {
  const std::string written = model_store::JsonFrom(facts);
  const auto again = model_store::ModelFactsFromJson(written);
  Require(again && model_store::JsonFrom(*again) == written &&
          model_store::SchemaInJson(written) == model_store::kModelSchema);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  static_cast<void>(model_store::SchemaInJson(text));
  if (const auto facts = model_store::ModelFactsFromJson(text)) WrittenAndReadAgain(*facts);
  if (const auto state = model_store::ModelStateFromJson(text)) {
    Require(model_store::ModelStateFromJson(model_store::JsonFrom(*state)) == *state);
  }
  const auto diagnosed = model_store::ModelFactsFromDiagnosis(text);
  if (diagnosed) {
    WrittenAndReadAgain(*diagnosed);
  } else {
    Require(!diagnosed.error().empty());
  }
  return 0;
}
