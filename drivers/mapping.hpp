// The user's word about the figures of a live source: a file as `posed inspect --write` makes it.
// It goes before what a driver or the recogniser says of the joints that it names. Cold.
#pragma once

#include <string>

#include "drivers/driver.hpp"
#include "proto/frame/profile.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers {

struct Mapping {
  std::string file;  // its name, for sentences
  std::string text;  // the log keeps it
  Profile profile;
};

// An error names the file and the line.
Result<Mapping> parse_mapping(std::string text, std::string file);
Result<Mapping> load_mapping(const std::string& file);

// Gives bones and T frames to each body that has all joints of the mapping but those of fingers.
// Others keep theirs; the sentence returned says which and why, and is empty if there is none.
// Rigid bodies, which have one joint, are no figures.
[[nodiscard]] std::string use_mapping(const Mapping& mapping, SourceLayout& layout);

}  // namespace posed::drivers
