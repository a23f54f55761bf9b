// JointNames: gives each joint of a file a name of its own, because names identify joints on the
// wire. A joint that has the name of an earlier one gets its parent's before it, such as
// "RightHand/Thumb1"; where that does not tell it apart either, or is too long, a number behind it.
#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "proto/text/clean.hpp"

namespace posed::clip {

inline constexpr std::size_t kMaxJointName = 200;  // bytes, in a file

// One thread.
class JointNames {
 public:
  // Returns the name of the next joint. `parent` is the name of its parent as it was returned;
  // empty: it has none.
  [[nodiscard]] std::string add(std::string name, const std::string& parent) {
    if (numbers_.try_emplace(name, 1).second) return name;
    const std::string path = parent + "/" + name;
    if (!parent.empty() && path.size() <= kMaxPath) name = path;
    std::string own = name;
    while (!numbers_.try_emplace(own, 1).second) {
      own = name + "-" + std::to_string(++numbers_[name]);
    }
    if (renamed_.empty()) renamed_ = own;
    return own;
  }

  // A sentence for people; empty: all have the names that the file gives them.
  [[nodiscard]] std::string warning() const {
    if (renamed_.empty()) return {};
    return "joints that have the name of an earlier one are called by their parent, too, as " +
           in_quotes(renamed_);
  }

 private:
  // Bytes; shorter than the 128 that messages keep of a name, with room for a number.
  static constexpr std::size_t kMaxPath = 110;

  std::map<std::string, int> numbers_;  // [name] the last number behind it
  std::string renamed_;                 // the first of those that were renamed
};

}  // namespace posed::clip
