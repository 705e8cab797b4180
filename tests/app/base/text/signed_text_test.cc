#include "app/base/text/signed_text.h"

#include <catch2/catch.hpp>
#include <vector>

#include "tests/app/base/text/test_keys.h"

namespace plumbline::text {
namespace {

std::string Refusal(const std::string& signed_text, const std::vector<PublicKey>& keys) {
  const Result<VerifiedText> verified = Verified(signed_text, keys);
  return verified ? "verified" : verified.error();
}

}  // namespace

TEST_CASE("the signature is that of RFC 8032, section 7.1, first example") {
  const auto empty = SignedText("", test::kPrivateKey);
  REQUIRE(empty);
  CHECK(
      *empty ==
      "plumbline-signed-1 ed25519 "
      "5VZDAMNgrHKQhuLMgG6CioSHfx645dl02HPgZSJJAVVfuIIVkKM7rMYeOXAc+bRr0lv18FlbviRlUUFDjnoQCw==\n");
  const std::vector<PublicKey> keys = {{"plant.pem", test::kPublicKey}};
  CHECK(Refusal(*empty, keys) == "verified");
}

TEST_CASE("a signed text is returned byte for byte, with the key that verifies it") {
  const std::string text = std::string("{\"a\": 1}\nsecond line\r\n") + '\0' + "end";
  const auto signed_text = SignedText(text, test::kPrivateKey);
  REQUIRE(signed_text);
  const std::vector<PublicKey> keys = {{"old.pem", test::kOtherPublicKey},
                                       {"plant.pem", test::kPublicKey}};
  const auto verified = Verified(*signed_text, keys);
  REQUIRE(verified);
  CHECK(verified->text == text);
  CHECK(verified->key == "plant.pem");
}

TEST_CASE("a text with any byte changed is refused") {
  const std::string good = *SignedText("{\"mean\": 1}\n", test::kPrivateKey);
  const std::vector<PublicKey> keys = {{"plant.pem", test::kPublicKey}};
  for (std::size_t k = 0; k < good.size(); ++k) {
    std::string bad = good;
    bad[k] = static_cast<char>(bad[k] ^ 1);
    CAPTURE(k);
    CHECK_FALSE(Verified(bad, keys));
  }
  CHECK_FALSE(Verified(good + " ", keys));
  CHECK_FALSE(Verified(good.substr(0, good.size() - 1), keys));
}

TEST_CASE("the reason says what is missing") {
  const std::string good = *SignedText("text", test::kPrivateKey);
  CHECK(Refusal("{}", {}) == "is not signed; get the signed file from the plant");
  CHECK(Refusal(good, {}).find("no public key of the plant") != std::string::npos);
  CHECK(Refusal(good, {{"other.pem", test::kOtherPublicKey}})
            .find("no installed key verifies its signature") == 0);
  CHECK(Refusal(good, {{"broken.pem", "no key"}, {"private.pem", test::kPrivateKey}})
            .find("broken.pem is not an Ed25519 public key in PEM; private.pem is not") !=
        std::string::npos);
  CHECK(SignedText("text", test::kPublicKey).error().find("is not an Ed25519 private key") == 0);
}

}  // namespace plumbline::text
