// Counts the threads that this process starts, for tests that bound their number.
#pragma once

namespace fivepipe::test {

// Number of threads started so far through pthread_create, which std::thread and std::jthread call.
int thread_starts();

}  // namespace fivepipe::test
