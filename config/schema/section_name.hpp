/// The names of a configuration's sections, found by the members of `Config` that hold them.
#pragma once

#include <string_view>
#include <vector>

#include "config/schema/config.hpp"

namespace crepes {

/// The visitor of `Config::visit` that finds the key of one of its members.
class SectionNameFinder {
 public:
  explicit SectionNameFinder(const void* member) : member_(member) {}

  [[nodiscard]] std::string_view found() const { return found_; }

  template <class Section>
  void section(std::string_view key, Section& section, Change /*when*/, std::string_view /*help*/) {
    if (&section == member_) found_ = key;
  }
  template <class Item>
  void list(std::string_view key, std::vector<Item>& items, Change /*when*/,
            std::string_view /*help*/) {
    if (&items == member_) found_ = key;
  }

 private:
  const void* member_;
  std::string_view found_;
};

/// For example `swarm` for `&Config::swarm`.
template <class Section>
[[nodiscard]] std::string_view section_name(Section Config::*member) {
  Config config;
  SectionNameFinder finder(&(config.*member));
  config.visit(finder);
  return finder.found();
}

}  // namespace crepes
