// Worker threads for tests of the CPU backends.
#pragma once
#include "common/base/worker_pool.h"

namespace fivepipe::test {

inline base::WorkerPool& test_pool() {
  static base::WorkerPool pool(2);
  return pool;
}

}  // namespace fivepipe::test
