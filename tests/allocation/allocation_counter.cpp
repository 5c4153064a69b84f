#include "tests/allocation/allocation_counter.hpp"

#include <cstdlib>
#include <new>

namespace {

std::size_t count = 0;
std::size_t bytes = 0;

void* counted(std::size_t size) noexcept {
  ++count;
  bytes += size;
  return std::malloc(size);
}

void* counted_or_thrown(std::size_t size) {
  if (void* memory = counted(size)) return memory;
  throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t size) { return counted_or_thrown(size); }
void* operator new[](std::size_t size) { return counted_or_thrown(size); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return counted(size); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return counted(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace crepes::test {

std::size_t allocations() { return count; }
std::size_t allocated_bytes() { return bytes; }

}  // namespace crepes::test
