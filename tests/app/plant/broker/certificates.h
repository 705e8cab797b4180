// Certificates for a test's broker, made by openssl.
#pragma once

#include <cstdlib>
#include <fstream>
#include <string>

namespace plumbline::test {

inline bool RunIn(const std::string& folder, const std::string& command) {
  return std::system(("cd " + folder + " && " + command + " >/dev/null 2>&1").c_str()) == 0;
}

/// A certificate authority NAME.pem with its NAME.key. @return  false without openssl
inline bool MakeAuthority(const std::string& folder, const std::string& name) {
  return RunIn(folder,
               "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 "
               "-subj /CN=" +
                   name + " -keyout " + name + ".key -out " + name + ".pem");
}

/// broker.pem and broker.key of a broker on 127.0.0.1.
inline bool MakeBrokerCertificate(const std::string& folder, const std::string& authority) {
  std::ofstream(folder + "/names") << "subjectAltName=IP:127.0.0.1\n";
  return RunIn(folder,
               "openssl req -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes "
               "-subj /CN=broker -keyout broker.key -out broker.csr") &&
         RunIn(folder, "openssl x509 -req -in broker.csr -CA " + authority + ".pem -CAkey " +
                           authority +
                           ".key -CAcreateserial -days 2 -extfile names -out broker.pem");
}

}  // namespace plumbline::test
