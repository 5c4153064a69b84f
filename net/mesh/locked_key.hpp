/// Secrets in memory of their own. For the .cpp files that hold keys.
#pragma once

#include <sodium.h>

#include <memory>
#include <new>

#include "estimator/core/contract.hpp"

namespace crepes {

/// A copy of the key in memory that is not swapped, not dumped, and overwritten at the end.
template <class Key>
[[nodiscard]] std::shared_ptr<const Key> locked(const Key& key) {
  CREPES_EXPECT(sodium_init() >= 0, "the system has random numbers");
  void* const memory = sodium_malloc(sizeof(Key));
  CREPES_EXPECT(memory != nullptr, "there is memory for a key");
  return {new (memory) Key(key), sodium_free};
}

}  // namespace crepes
