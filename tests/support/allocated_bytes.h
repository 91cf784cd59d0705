// Counts the heap memory that the calling thread requests.
#pragma once
#include <cstddef>

namespace fivepipe::test {

// Bytes that the calling thread has requested from operator new since it started. Memory that is
// freed again still counts. Linking allocated_bytes.cpp replaces the global operator new.
std::size_t allocated_bytes();

}  // namespace fivepipe::test
