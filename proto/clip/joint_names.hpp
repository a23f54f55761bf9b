// JointNames: gives each joint of a file a name of its own, because names identify joints on the
// wire. A joint that has the name of an earlier one gets its parent's before it, such as
// "RightHand/Thumb1"; where that does not tell it apart either, or is too long, a number behind it.
// A name that is longer than messages keep is cut.
#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "proto/text/clean.hpp"

namespace posed::clip {

// One thread.
class JointNames {
 public:
  // Returns the name of the next joint. `parent` is the name of its parent as it was returned;
  // empty: it has none.
  [[nodiscard]] std::string add(std::string name, const std::string& parent) {
    if (name.size() > kMaxName) name = clean(name, kMaxName);
    if (numbers_.try_emplace(name, 1).second) return name;
    const std::string path = parent + "/" + name;
    if (!parent.empty() && path.size() <= kMaxName) name = path;
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
  // Bytes; with the dots of a cut and a number within the 128 that messages keep of a name.
  static constexpr std::size_t kMaxName = 120;

  std::map<std::string, int> numbers_;  // [name] the last number behind it
  std::string renamed_;                 // the first of those that were renamed
};

}  // namespace posed::clip
