#include "launch/supervise/interrupt.h"

#include <csignal>
#include <initializer_list>

namespace fivepipe::launch {
namespace {

volatile std::sig_atomic_t received = 0, newest = 0;
void on_signal(int number) {
  newest = number;
  received = received + 1;
}

}  // namespace

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) sigaction(number, &action, nullptr);
  ignore_closed_pipes();
}

void ignore_closed_pipes() { std::signal(SIGPIPE, SIG_IGN); }

int signals_received() { return received; }
int newest_signal() { return newest; }

}  // namespace fivepipe::launch
