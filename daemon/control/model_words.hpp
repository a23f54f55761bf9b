// What a model file says of itself, for lists that people read. Any thread; cold.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "proto/frame/skeleton.hpp"

namespace posed::control {

struct ModelWords {
  std::string learnt{};    // "turns walk into sneak, from 12 clips of 6 people"
  std::string skeleton{};  // whom it serves, "any person's"; empty for gestures
  std::string verdict{};   // of the training; of bytes that are no model: what is wrong with them
  std::string strip{};     // SVG path data of a thumbnail; empty for gestures
};

// `kind`: "style" or "gesture". `name`: the file's name, for the sentences. `known`: skeletons that
// a style in its own space is drawn on. Never fails: bytes that are no model have a verdict that
// says why, and nothing else. Sentences are clean, and cut after 400 bytes.
[[nodiscard]] ModelWords words_of_model(
    std::string_view bytes, std::string_view kind, const std::string& name,
    std::span<const std::shared_ptr<const Skeleton>> known = {});

}  // namespace posed::control
