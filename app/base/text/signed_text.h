// Texts with an Ed25519 signature in their first line (RFC 8032, by OpenSSL).
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "firmware-like/result.h"

namespace plumbline::text {

/// A public key that texts may be signed with.
struct PublicKey {
  std::string name;  ///< for messages: its file
  std::string pem;
};

/// "plumbline-signed-1 ed25519 <signature in base64>\n", followed by the text byte for byte, which
/// is all that is signed.
/// @param private_key_pem  of `openssl genpkey -algorithm ed25519`, without a passphrase
Result<std::string> SignedText(std::string_view text, std::string_view private_key_pem);

struct VerifiedText {
  std::string text;
  std::string key;  ///< name of the key that verifies it
};

/// The text, if one of the keys verifies it; nothing of an unverified text is read.
/// @return  an error with what is wrong and the remedy; a key that is not an Ed25519 public key is
///          named if no other one verifies the text
Result<VerifiedText> Verified(std::string_view signed_text, std::span<const PublicKey> keys);

}  // namespace plumbline::text
