// Fills the packed arrays of a message, reusing their memory.
#pragma once

#include <algorithm>
#include <bitset>
#include <cstddef>
#include <span>
#include <string>

#include <google/protobuf/repeated_field.h>

namespace posed::message {

// Replaces the content of `field` with `values`.
inline void assign(google::protobuf::RepeatedField<float>& field, std::span<const float> values) {
  field.Resize(static_cast<int>(values.size()), 0.0F);
  std::ranges::copy(values, field.begin());
}

// One byte for each flag, 0 or 1.
template <std::size_t N>
void assign_flags(std::string& bytes, const std::bitset<N>& valid, std::size_t count) {
  bytes.resize(count);
  for (std::size_t i = 0; i < count; ++i) bytes[i] = valid[i] ? 1 : 0;
}

}  // namespace posed::message
