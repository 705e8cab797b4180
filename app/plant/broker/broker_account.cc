#include "app/plant/broker/broker_account.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>

#include "drivers/files/text_file.h"

namespace plumbline::plant {

void OpenLibrary() {
  static const int opened = mosquitto_lib_init();
  static_cast<void>(opened);
}

Result<void> UseAccount(mosquitto* client, const BrokerAccount& account) {
  if (!account.tls_ca.empty() && mosquitto_tls_set(client, account.tls_ca.c_str(), nullptr, nullptr,
                                                   nullptr, nullptr) != MOSQ_ERR_SUCCESS) {
    return Error{account.tls_ca + ": contains no readable CA certificates"};
  }
  if (account.username.empty()) return {};
  std::string password;
  if (!account.password_file.empty()) {
    const Result<std::string> text = files::ReadTextFile(account.password_file);
    if (!text) return Error{fmt::format("{}: {}", account.password_file, text.error())};
    password = text->substr(0, text->find_first_of("\r\n"));
  }
  const int code = mosquitto_username_pw_set(client, account.username.c_str(),
                                             password.empty() ? nullptr : password.c_str());
  if (code != MOSQ_ERR_SUCCESS) return Error{ConnectionFailure(code, "")};
  return {};
}

std::string ConnectionFailure(int code, const std::string& last_error) {
  if (code == MOSQ_ERR_TLS && !last_error.empty()) {
    return fmt::format(
        "TLS: {}; check tls_ca, that host is a name in the broker's certificate, and the clock",
        last_error);
  }
  if (code == MOSQ_ERR_ERRNO && errno != 0) return std::strerror(errno);
  if (code == MOSQ_ERR_ERRNO) return "the server there is not an MQTT broker";
  if (code == MOSQ_ERR_NOMEM) return "not enough memory for a packet";
  return mosquitto_strerror(code);
}

}  // namespace plumbline::plant
