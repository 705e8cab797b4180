#include "app/base/service/signals.h"

#include <pthread.h>
#include <sys/signalfd.h>

#include <csignal>
#include <initializer_list>

namespace plumbline::service {

int OpenSignalDescriptor() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&signals, number);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
}

}  // namespace plumbline::service
