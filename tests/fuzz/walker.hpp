// A walk of so many frames, which models of untrusted files are tried on.
#pragma once

#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/clip.hpp"
#include "tests/fuzz/demand.hpp"

namespace posed::fuzz {

inline clip::Clip walker(int frames) {
  static const auto walk = motion::make_walker({.seconds = 1.0});
  demand(walk.has_value());
  clip::Clip part = *walk;
  part.channels.conservativeResize(frames, Eigen::NoChange);
  return part;
}

}  // namespace posed::fuzz
