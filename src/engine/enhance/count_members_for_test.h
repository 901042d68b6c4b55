#pragma once

#include <cstddef>

namespace anchorsplat {

struct AnyMember {
  template <class T>
  operator T() const;  // NOLINT(google-explicit-constructor)
};

// Number of members of an aggregate: how many values initialise it.
template <class Aggregate, class... Values>
constexpr size_t CountMembers() {
  if constexpr (requires { Aggregate{Values{}..., AnyMember{}}; }) {
    return CountMembers<Aggregate, Values..., AnyMember>();
  } else {
    return sizeof...(Values);
  }
}

}  // namespace anchorsplat
