// A skeleton as JSON, with everything that Skeleton holds but the limits of channels. Numbers come
// back to the last bit. Cold.
#pragma once

#include <string>
#include <string_view>

#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::clip {

// Bytes of names that are not UTF-8 are replaced.
[[nodiscard]] std::string skeleton_json(const Skeleton& skeleton);

// Reads untrusted text. The skeleton has passed Skeleton::finish(). `name` is used in errors.
Result<Skeleton> skeleton_from_json(std::string_view text, const std::string& name);

}  // namespace posed::clip
