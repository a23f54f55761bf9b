// Skeleton profiles: names, units and zero pose of a well-known figure, where its joint names and
// OFFSETs alone do not define them. From config/skeletons/*.toml, built into the binary, or a
// user's own file.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"
#include "proto/rig/up.hpp"

namespace posed {

// What the name of a user's own file ends in; any other name is that of a built-in profile.
inline constexpr std::string_view kProfileEnding = ".toml";

struct Profile {
  std::string name;
  std::optional<double> metres_per_unit;  // of a file that does not state its unit
  UpAxis up = UpAxis::kPlusY;             // the axis of such a file that points up
  bool person = true;              // as tall as a person, so the unit can be checked by the height
  std::vector<std::string> match;  // the profile fits a figure with all these joints,
  std::map<std::string, std::string> along;  // if these joints' OFFSETs point this way ("-y")
  std::map<std::string, Bone> bones;         // joint name -> canonical bone
  // Joint name -> T; other bones get theirs from the recogniser (proto/rig).
  std::map<std::string, Eigen::Quaterniond> T;
};

// All profiles, read once. They are built into the program; a mistake in one is a bug, which the
// unit tests find. Cold.
[[nodiscard]] std::span<const Profile> profiles();

// `text` is TOML; `name` is used in error messages. Cold.
Result<Profile> parse_profile(std::string_view text, const std::string& name);
// The text of a user's own file. Cold.
Result<std::string> load_profile_text(const std::string& file);

// Returns the profile called `name`, or the one in the file of this name if it ends in .toml; with
// an empty name, the first that matches the skeleton and whose bones are all there, or null. An
// unknown name is an error that lists the known ones. Cold.
Result<std::shared_ptr<const Profile>> find_profile(const Skeleton& skeleton,
                                                    const std::string& name);

// The bones of the skeleton's joints as the profile defines them [joint]. An error names the joints
// that are missing; those of fingers may be, in a profile of a body. Cold.
Result<std::vector<std::optional<Bone>>> named_bones(const Profile& profile,
                                                     const Skeleton& skeleton);

// The T frames that the profile defines [joint]. Cold.
[[nodiscard]] std::vector<std::optional<Eigen::Quaterniond>> known_t(const Profile& profile,
                                                                     const Skeleton& skeleton);

}  // namespace posed
