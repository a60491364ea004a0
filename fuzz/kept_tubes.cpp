// For fuzzers that make tubes anew in each execution. A tube is 2 MB; that fresh memory is given to each was half of
// the time. It gets that of one before, and who touches it in between is found all the same. (Nothing else is both
// aligned and that large.)
#include <cstddef>
#include <cstdlib>
#include <new>
#include <utility>

#include <sanitizer/allocator_interface.h>
#include <sanitizer/asan_interface.h>

namespace {

constexpr std::size_t kWorthKeeping = 1 << 20;

struct Kept {
  void* block = nullptr;
  std::size_t size = 0;
};
Kept kept[2];

}  // namespace

void* operator new(std::size_t size, std::align_val_t alignment) {
  for (Kept& each : kept)
    if (each.block && size == each.size) {
      __asan_unpoison_memory_region(each.block, size);
      return std::exchange(each.block, nullptr);
    }
  void* fresh = std::aligned_alloc(static_cast<std::size_t>(alignment), size);
  if (!fresh) throw std::bad_alloc();
  return fresh;
}

void operator delete(void* block, std::align_val_t) noexcept {
  const std::size_t size = __sanitizer_get_allocated_size(block);
  if (size >= kWorthKeeping)
    for (Kept& each : kept)
      if (!each.block) {
        __asan_poison_memory_region(block, size);
        each = {block, size};
        return;
      }
  std::free(block);
}
void operator delete(void* block, std::size_t, std::align_val_t alignment) noexcept {
  operator delete(block, alignment);
}
