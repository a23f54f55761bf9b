// Skeleton profiles: what the names, units and zero pose of a well-known figure mean, where the
// names and OFFSETs alone do not say it. config/skeletons/*.toml, built into the binary.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"
#include "proto/frame/t_pose.hpp"

namespace posed {

struct Profile {
  std::string name;
  std::optional<double> metres_per_unit;  // of a file that names no unit
  bool person = true;              // stands as high as people do, by which its unit is checked
  std::vector<std::string> match;  // a figure with all these joints is this one,
  std::map<std::string, std::string> along;     // if these joints' OFFSETs point so ("-y")
  std::map<std::string, Bone> bones;            // joint name -> canonical bone
  std::map<std::string, Eigen::Quaterniond> T;  // joint name -> T; the rule finds the others
};

// All profiles, read once. They are part of the program: a mistake in one is a bug, which the unit
// tests find. Cold.
[[nodiscard]] std::span<const Profile> profiles();

// `text` is TOML; `name` stands in the errors. Cold.
[[nodiscard]] Result<Profile> parse_profile(std::string_view text, const std::string& name);

// The profile called `name`; with an empty name the first that matches the skeleton, or null. An
// unknown name is an error that lists the known ones. Cold.
[[nodiscard]] Result<const Profile*> find_profile(const Skeleton& skeleton,
                                                  const std::string& name);

// Sets the bones as the profile says. An error names its joints that are missing. Cold.
[[nodiscard]] Result<> name_bones(const Profile& profile, Skeleton& skeleton);

// The T frames that the profile gives, for set_t_frames(). Cold.
[[nodiscard]] KnownT known_t(const Profile& profile, const Skeleton& skeleton);

}  // namespace posed
