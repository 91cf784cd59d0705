#include "tests/support/thread_starts.h"

#include <dlfcn.h>
#include <pthread.h>

#include <atomic>

namespace {

std::atomic<int> starts = 0;

}  // namespace

// The definition in the executable precedes that of the C library (and of a sanitizer), to which it
// forwards.
extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes,
                              void* (*start)(void*), void* argument) {
  using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  static const auto next = reinterpret_cast<Create>(dlsym(RTLD_NEXT, "pthread_create"));
  ++starts;
  return next(thread, attributes, start, argument);
}

namespace fivepipe::test {

int thread_starts() { return starts; }

}  // namespace fivepipe::test
