// Fuzzer: arbitrary text as a signed prior and as the JSON files of a prior: refused with a reason,
// or values that survive writing and reading. No input has a valid signature.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "app/base/text/signed_text.h"
#include "app/measure/siblings/prior_json.h"
#include "tests/app/base/text/test_keys.h"

namespace {

using namespace plumbline;  // NOLINT(google-build-using-namespace)

void Require(bool condition) {
  if (!condition) std::abort();
}

template <typename T, typename Read>
void WrittenAndReadAgain(const Result<T>& read, Read again) {
  if (!read) return Require(!read.error().empty());
  const std::string written = measure::JsonFrom(*read);
  const Result<T> second = again(written);
  Require(second && measure::JsonFrom(*second) == written);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  static const std::vector<text::PublicKey> keys = {{"plant.pem", test::kPublicKey}};
  const auto verified = text::Verified(text, keys);
  Require(!verified && !verified.error().empty());
  WrittenAndReadAgain(measure::FleetPriorFromJson(text), measure::FleetPriorFromJson);
  WrittenAndReadAgain(measure::ArmSizesFromJson(text), measure::ArmSizesFromJson);
  const auto sizes_of_six = [](std::string_view json) {
    return measure::AgreedSizesFromJson(json, 6);
  };
  WrittenAndReadAgain(sizes_of_six(text), sizes_of_six);
  return 0;
}
