// Two worker threads, which the tests of a program share.
#pragma once
#include "common/base/worker_pool.h"

namespace fivepipe::test {

inline base::WorkerPool& test_pool() {
  static base::WorkerPool pool(2);
  return pool;
}

}  // namespace fivepipe::test
