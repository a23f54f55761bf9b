// What a model file says of itself, for lists that people read. Any thread; cold.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "proto/frame/skeleton.hpp"

namespace posed::control {

struct ModelWords {
  std::string learnt{};    // "walk -> sneak, from 12 clips of 6 people"; empty: it does not say
  std::string skeleton{};  // whom it serves; empty for gestures, or if it does not say
  std::string verdict{};   // of the training; of bytes that are no model: what is wrong with them
  std::string strip{};     // SVG path data of a thumbnail; empty for gestures
};

// `kind`: "style" or "gesture". `name`: the file's name, for the sentences. `known`: skeletons that
// a style in its own space is drawn on. Never fails: bytes that are no model get a verdict saying
// so.
[[nodiscard]] ModelWords words_of_model(
    std::string_view bytes, std::string_view kind, const std::string& name,
    std::span<const std::shared_ptr<const Skeleton>> known = {});

}  // namespace posed::control
