#include "daemon/ctl/setup/questions.hpp"

#include <fmt/core.h>

#include <istream>
#include <ostream>

namespace crepes {

Result<std::string> Questions::ask(const std::string& question, const std::string& proposal,
                                   const Check& check) {
  if (in_ == nullptr) {
    const std::string fault = check(proposal);
    return fault.empty() ? Result<std::string>(proposal)
                         : fail(ErrorCode::kUsage, fmt::format("{}: {}", question, fault));
  }
  for (;;) {
    out_ << question << (proposal.empty() ? ": " : fmt::format(" [{}]: ", proposal)) << std::flush;
    std::string answer;
    if (!std::getline(*in_, answer)) return fail(ErrorCode::kUsage, "no answer to: " + question);
    if (answer.empty()) answer = proposal;
    const std::string fault = check(answer);
    if (fault.empty()) return answer;
    out_ << "  " << fault << '\n';
  }
}

}  // namespace crepes
