#include "estimator/vision/decoding/phase_memory.hpp"

namespace crepes {

void PhaseMemory::update(const CodeMatch& match, Timestamp now) {
  if (match.code >= phases_.size()) phases_.resize(match.code + 1);
  if (!phases_[match.code]) ++known_;
  phases_[match.code] = {match.phase, now};
}

}  // namespace crepes
