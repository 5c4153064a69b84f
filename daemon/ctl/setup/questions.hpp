/// Questions to somebody at a terminal.
#pragma once

#include <functional>
#include <iosfwd>
#include <string>

#include "estimator/core/result.hpp"

namespace crepes {

/// Asks on `out` and reads the answers, one a line, from `in`. Without `in` every question has its
/// proposal as answer.
class Questions {
 public:
  /// What is wrong with an answer; empty if nothing is.
  using Check = std::function<std::string(const std::string& answer)>;

  /// `in` may be null; both must outlive this.
  Questions(std::istream* in, std::ostream& out) : in_(in), out_(out) {}

  /// The answer; an empty line accepts `proposal`. Asks again until `check` accepts the answer. The
  /// end of the input is an error.
  [[nodiscard]] Result<std::string> ask(const std::string& question, const std::string& proposal,
                                        const Check& check);

  [[nodiscard]] bool has_answers() const { return in_ != nullptr; }

 private:
  std::istream* in_;
  std::ostream& out_;
};

}  // namespace crepes
