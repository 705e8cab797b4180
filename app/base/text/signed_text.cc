#include "app/base/text/signed_text.h"

#include <fmt/format.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>

namespace plumbline::text {
namespace {

constexpr std::string_view kHead = "plumbline-signed-1 ed25519 ";
constexpr std::size_t kSignatureBytes = 64, kSignatureCharacters = 88;

using Bytes = std::array<unsigned char, kSignatureBytes>;
using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;
using Bio = std::unique_ptr<BIO, decltype(&BIO_free)>;
using Context = std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)>;

const unsigned char* BytesOf(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

/// Null if the PEM is not an Ed25519 key.
Key Ed25519From(std::string_view pem, decltype(&PEM_read_bio_PUBKEY) read) {
  const Bio bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())), &BIO_free);
  const auto no_passphrase = [](char*, int, int, void*) { return -1; };
  Key key(bio ? read(bio.get(), nullptr, no_passphrase, nullptr) : nullptr, &EVP_PKEY_free);
  ERR_clear_error();
  if (key && EVP_PKEY_id(key.get()) != EVP_PKEY_ED25519) key.reset();
  return key;
}

std::string Base64(const Bytes& bytes) {
  std::array<unsigned char, kSignatureCharacters + 1> text{};
  EVP_EncodeBlock(text.data(), bytes.data(), static_cast<int>(bytes.size()));
  return {text.begin(), text.begin() + kSignatureCharacters};
}

/// nullopt unless the text is exactly what Base64 writes.
std::optional<Bytes> BytesFromBase64(std::string_view text) {
  std::array<unsigned char, kSignatureCharacters / 4 * 3> decoded{};
  if (text.size() != kSignatureCharacters ||
      EVP_DecodeBlock(decoded.data(), BytesOf(text), static_cast<int>(text.size())) < 0) {
    ERR_clear_error();
    return std::nullopt;
  }
  Bytes bytes{};
  std::copy_n(decoded.begin(), bytes.size(), bytes.begin());
  return Base64(bytes) == text ? std::optional(bytes) : std::nullopt;
}

bool Verifies(EVP_PKEY* key, const Bytes& signature, std::string_view text) {
  const Context context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  const bool valid = context &&
                     EVP_DigestVerifyInit(context.get(), nullptr, nullptr, nullptr, key) == 1 &&
                     EVP_DigestVerify(context.get(), signature.data(), signature.size(),
                                      BytesOf(text), text.size()) == 1;
  ERR_clear_error();
  return valid;
}

}  // namespace

Result<std::string> SignedText(std::string_view text, std::string_view private_key_pem) {
  const Key key = Ed25519From(private_key_pem, &PEM_read_bio_PrivateKey);
  if (!key) {
    return Error{
        "is not an Ed25519 private key in PEM without a passphrase; make one with: openssl genpkey "
        "-algorithm ed25519 -out plant.key"};
  }
  Bytes signature{};
  std::size_t size = signature.size();
  const Context context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  if (!context || EVP_DigestSignInit(context.get(), nullptr, nullptr, nullptr, key.get()) != 1 ||
      EVP_DigestSign(context.get(), signature.data(), &size, BytesOf(text), text.size()) != 1) {
    ERR_clear_error();
    return Error{"the cryptographic library refuses to sign with this key"};
  }
  return fmt::format("{}{}\n{}", kHead, Base64(signature), text);
}

Result<VerifiedText> Verified(std::string_view signed_text, std::span<const PublicKey> keys) {
  const auto end_of_line = signed_text.find('\n');
  if (!signed_text.starts_with(kHead) || end_of_line == std::string_view::npos)
    return Error{"is not signed; get the signed file from the plant"};
  const std::string_view line = signed_text.substr(0, end_of_line);
  const std::string_view text = signed_text.substr(end_of_line + 1);
  const std::optional<Bytes> signature = BytesFromBase64(line.substr(kHead.size()));
  std::string unusable;
  for (const PublicKey& one : keys) {
    const Key key = Ed25519From(one.pem, &PEM_read_bio_PUBKEY);
    if (!key) {
      unusable += fmt::format("; {} is not an Ed25519 public key in PEM", one.name);
    } else if (signature && Verifies(key.get(), *signature, text)) {
      return VerifiedText{std::string(text), one.name};
    }
  }
  if (keys.empty())
    return Error{"cannot be verified: no public key of the plant (*.pem) is installed"};
  return Error{fmt::format(
      "no installed key verifies its signature: it was changed, or signed by somebody else{}; get "
      "file and key from the plant again",
      unusable)};
}

}  // namespace plumbline::text
