// What all connections to a broker have in common: the library, who logs in, and why it failed.
#pragma once

#include <mosquitto.h>

#include <string>

#include "firmware-like/result.h"

namespace plumbline::plant {

/// Initialises libmosquitto, once for the process.
void OpenLibrary();

/// At least once; repetitions are the receiver's to discard.
inline constexpr int kQos = 1;

/// Who logs in, and which certificates verify the broker. Empty: none.
struct BrokerAccount {
  std::string tls_ca, username;
  std::string password_file;  ///< the password is its first line
};

/// Reads the files, so that a new password or certificate is used at the next connection.
Result<void> UseAccount(mosquitto* client, const BrokerAccount& account);

/// Why a connection failed.
/// @param code        MOSQ_ERR_...
/// @param last_error  what the library last logged as an error
std::string ConnectionFailure(int code, const std::string& last_error);

}  // namespace plumbline::plant
