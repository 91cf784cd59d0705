#include "tests/support/allocated_bytes.h"

#include <cstdlib>
#include <new>

namespace {

thread_local std::size_t bytes_of_thread = 0;

void* counted(std::size_t size, void* memory) {
  if (!memory) throw std::bad_alloc();
  bytes_of_thread += size;
  return memory;
}

}  // namespace

// The other forms of the standard library call these, but those of a sanitizer do not. The aligned
// nothrow forms, which nothing here uses, are not replaced.
void* operator new(std::size_t size) { return counted(size, std::malloc(size > 0 ? size : 1)); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  const std::size_t multiple = std::size_t(alignment);
  return counted(size, std::aligned_alloc(multiple, (size + multiple) / multiple * multiple));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

void* operator new[](std::size_t size) { return operator new(size); }
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return operator new(size, alignment);
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  void* const memory = std::malloc(size > 0 ? size : 1);
  if (memory) bytes_of_thread += size;
  return memory;
}
void* operator new[](std::size_t size, const std::nothrow_t& tag) noexcept {
  return operator new(size, tag);
}
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace fivepipe::test {

std::size_t allocated_bytes() { return bytes_of_thread; }

}  // namespace fivepipe::test
