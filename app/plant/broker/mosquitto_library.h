// Initialisation of libmosquitto, once for the process.
#pragma once

#include <mosquitto.h>

namespace plumbline::plant {

inline void OpenLibrary() {
  static const int opened = mosquitto_lib_init();
  static_cast<void>(opened);
}

/// At least once; repetitions are the receiver's to discard.
inline constexpr int kQos = 1;

}  // namespace plumbline::plant
