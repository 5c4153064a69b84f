/// The vocabulary of the configuration's schema: the calls in `visit(v)` of each settings struct.
///
/// Each config struct is a plain aggregate whose defaults are the documented defaults; `visit(v)`
/// lists its fields for the reader, the writer and the reference file alike:
///   v.required(key, member, [bounds,] help)     must be in the file
///   v.field(key, member, [bounds,] help)        may be left out
///   v.choice(key, member, choices, help)        an enumeration by name
///   v.section(key, member, [when,] help)        a nested struct
///   v.list(key, member, [when,] help)           a sequence of structs
///   v.optional_list(key, member, help)          one that may be left out
///   v.reference(key, help)                      names a file whose content takes its place before
///                                               anything is read, so no struct has a member for it
#pragma once

#include <cstdint>
#include <string_view>

namespace crepes {

/// Closed interval of a number.
struct Bounds {
  double min;
  double max;
};

/// A value of an enumeration and its name in the configuration.
template <class Enum>
struct Choice {
  std::string_view name;
  Enum value;
};
template <class Enum>
Choice(const char*, Enum) -> Choice<Enum>;  // which clang-tidy 14 cannot deduce for an aggregate
template <class Enum>
Choice(std::string_view, Enum) -> Choice<Enum>;

}  // namespace crepes
