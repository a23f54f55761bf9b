// Where the joints of a stream are, as the clients' examples print it.
#pragma once

#include <algorithm>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "models/motion/kinematics.hpp"
#include "proto/clip/clip.hpp"

namespace posed::test {

using Places = std::map<std::string, Eigen::Vector3d>;

// "  NAME x y z" and "  tip of NAME x y z".
inline Places printed_places(const std::string& text) {
  Places places;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("  ")) continue;
    std::istringstream words(line);
    std::vector<std::string> all;
    for (std::string word; words >> word;) all.push_back(word);
    REQUIRE(all.size() >= 4);
    std::string name = all[0];
    for (std::size_t i = 1; i + 3 < all.size(); ++i) name += " " + all[i];
    const std::size_t at = all.size() - 3;
    places[name] = {std::stod(all[at]), std::stod(all[at + 1]), std::stod(all[at + 2])};
  }
  return places;
}

// The joints of one frame of the clip, and the tips of those that have one.
inline Places places_of(const clip::Clip& clip, int frame, bool with_tips) {
  Places places;
  const motion::WorldPose pose = motion::world_pose(*clip.skeleton, clip.frame(frame));
  for (std::size_t j = 0; j < clip.skeleton->joints.size(); ++j) {
    const Joint& joint = clip.skeleton->joints[j];
    places[joint.name] = pose.position_m[j];
    if (!joint.end_site_m || !with_tips) continue;
    places["tip of " + joint.name] = pose.position_m[j] + pose.rotation[j] * *joint.end_site_m;
  }
  return places;
}

// How far the places are from those of the clip's nearest frame; 1 if they are of other joints.
inline double nearest_m(const Places& shown, const std::filesystem::path& path, bool with_tips) {
  const clip::Clip clip = clip::read_clip(path).value();
  double nearest_m = 1.0;
  for (int i = 0; i < clip.frames(); ++i) {
    const Places places = places_of(clip, i, with_tips);
    if (places.size() != shown.size()) return 1.0;
    double most_m = 0.0;
    for (const auto& [name, place] : places) {
      const auto same = shown.find(name);
      if (same == shown.end()) return 1.0;
      most_m = std::max(most_m, (place - same->second).norm());
    }
    nearest_m = std::min(nearest_m, most_m);
  }
  return nearest_m;
}

}  // namespace posed::test
