/// Secrets in memory of their own. For the .cpp files that hold keys.
#pragma once

#include <sodium.h>

#include <memory>
#include <new>

#include "estimator/core/contract.hpp"

namespace crepes {

/// What `locked` returns.
template <class Key>
struct LockedKey {
  std::shared_ptr<const Key> key;  ///< overwritten at the end, and not in core files
  bool is_locked = false;          ///< false: the system refuses to lock it, so it may be swapped
};

/// A copy of the key in memory of its own.
template <class Key>
[[nodiscard]] LockedKey<Key> locked(const Key& key) {
  CREPES_EXPECT(sodium_init() >= 0, "the system has random numbers");
  void* const memory = sodium_malloc(sizeof(Key));
  CREPES_EXPECT(memory != nullptr, "there is memory for a key");
  // sodium_malloc has tried to, and does not say whether it could.
  const bool is_locked = sodium_mlock(memory, sizeof(Key)) == 0;
  return {{new (memory) Key(key), sodium_free}, is_locked};
}

}  // namespace crepes
