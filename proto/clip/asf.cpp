#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "proto/clip/asf_parts.hpp"
#include "proto/text/clean.hpp"

namespace posed::clip {
namespace {

class AsfReader {
 public:
  AsfReader(std::string_view text, const std::string& name) : words_(text), name_(name) {
    AsfBone root;
    root.name = "root";
    root.has_parent = true;
    file_.bones.push_back(std::move(root));
    index_["root"] = 0;
  }

  Result<Acclaim> read();

 private:
  [[nodiscard]] std::unexpected<Error> error(std::string message) const {
    return fail(std::move(message), name_, words_.line());
  }
  Result<> section(const std::string& key);
  Result<> units();
  Result<> root();
  Result<> bone_data();
  Result<> bone();
  Result<> bone_entry(AsfBone& bone, const std::string& key);
  Result<> axis(AsfBone& bone);
  Result<> dof(AsfBone& bone);
  Result<> limits(AsfBone& bone);
  Result<> hierarchy();
  Result<> link(AsfBone& parent, std::string_view child);
  Result<double> number(std::string_view what);
  Result<> numbers(std::string_view what, double* values, int count);
  void skip_section();
  Result<> order(AsfBone& bone, std::string_view word);

  Words words_;
  const std::string& name_;
  AsfFile file_;
  std::map<std::string, int, std::less<>> index_;
  bool has_hierarchy_ = false;
};

Result<Acclaim> AsfReader::read() {
  if (!words_.starts_section()) {
    (void)words_.take();
    return error("does not begin with a ':' section, so it is not an ASF skeleton");
  }
  while (!words_.peek().empty()) {
    const std::string key = lower(words_.take());
    if (auto ok = section(key); !ok) return std::unexpected(ok.error());
  }
  if (!has_hierarchy_) return error("has no :hierarchy, so its bones are not joined");
  return acclaim_of(file_, name_);
}

void AsfReader::skip_section() {
  while (!words_.peek().empty() && !words_.starts_section()) (void)words_.take();
}

Result<> AsfReader::section(const std::string& key) {
  if (key == ":units") return units();
  if (key == ":root") return root();
  if (key == ":bonedata") return bone_data();
  if (key == ":hierarchy") return hierarchy();
  if (!key.starts_with(':')) return error(in_quotes(key) + " stands outside any section");
  skip_section();  // :version, :name, :documentation, :skin and other sections that posed does not
                   // need
  return {};
}

Result<double> AsfReader::number(std::string_view what) {
  const std::string_view word = words_.take();
  const auto value = parse_number(word);
  if (!value) return error(std::string(what) + ": " + in_quotes(word) + " is not a number");
  return *value;
}

Result<> AsfReader::numbers(std::string_view what, double* values, int count) {
  for (int i = 0; i < count; ++i) {
    const auto value = number(what);
    if (!value) return std::unexpected(value.error());
    values[i] = *value;
  }
  return {};
}

Result<> AsfReader::units() {
  while (!words_.peek().empty() && !words_.starts_section()) {
    const std::string key = lower(words_.take());
    if (key == "angle") {
      const std::string unit = lower(words_.take());
      if (unit != "deg" && unit != "rad")
        return error("angle is in deg or rad, not " + in_quotes(unit));
      file_.degrees = unit == "deg";
      continue;
    }
    const auto value = number(key);
    if (!value) return std::unexpected(value.error());
    if (key != "length") continue;
    if (!(*value > 1e-6)) return error("length should be more than 0; CMU's is 0.45");
    file_.length_unit = *value;
  }
  return {};
}

Result<> AsfReader::root() {
  while (!words_.peek().empty() && !words_.starts_section()) {
    const std::string key = lower(words_.take());
    if (key == "order") {
      if (auto ok = dof(file_.bones[0]); !ok) return ok;
    } else if (key == "axis") {
      if (auto ok = order(file_.bones[0], words_.take()); !ok) return ok;
    } else if (key == "position") {
      if (auto ok = numbers("position of the root", file_.root_position.data(), 3); !ok) return ok;
    } else if (key == "orientation") {
      if (auto ok = numbers("orientation of the root", file_.bones[0].axis.data(), 3); !ok)
        return ok;
    } else {
      return error(in_quotes(key) + " is not known in :root");
    }
  }
  return {};
}

Result<> AsfReader::bone_data() {
  while (!words_.peek().empty() && !words_.starts_section()) {
    if (lower(words_.take()) != "begin") return error("'begin' should open each bone in :bonedata");
    if (auto ok = bone(); !ok) return ok;
  }
  return {};
}

Result<> AsfReader::bone() {
  AsfBone bone;
  while (true) {
    if (words_.peek().empty() || words_.starts_section()) {
      return error("bone '" + bone.name + "' is not closed by 'end'");
    }
    const std::string key = lower(words_.take());
    if (key == "end") break;
    if (auto ok = bone_entry(bone, key); !ok) return ok;
  }
  if (bone.name.empty()) return error("a bone has no name");
  if (!bone.limits.empty() && bone.limits.size() != bone.dof.size()) {
    return error("bone '" + bone.name + "' has " + std::to_string(bone.dof.size()) + " dof but " +
                 std::to_string(bone.limits.size()) + " limits");
  }
  const double norm = bone.direction.norm();
  if (bone.length != 0.0 && std::abs(norm - 1.0) > 0.01) {
    return error("the direction of bone '" + bone.name + "' is not of length 1");
  }
  if (file_.bones.size() >= static_cast<std::size_t>(kMaxJoints)) {
    return error("has more than " + std::to_string(kMaxJoints - 1) + " bones");
  }
  if (!index_.emplace(bone.name, static_cast<int>(file_.bones.size())).second) {
    return error("a second bone is named " + in_quotes(bone.name));
  }
  file_.bones.push_back(std::move(bone));
  return {};
}

Result<> AsfReader::bone_entry(AsfBone& bone, const std::string& key) {
  if (key == "name") {
    bone.name = words_.take();
    if (bone.name.size() > 200) return error("a bone's name is longer than 200 characters");
    return {};
  }
  const std::string what = key + " of bone '" + bone.name + "'";
  if (key == "direction") return numbers(what, bone.direction.data(), 3);
  if (key == "length") return numbers(what, &bone.length, 1);
  if (key == "axis") return axis(bone);
  if (key == "dof") return dof(bone);
  if (key == "limits") return limits(bone);
  if (key == "id" || key == "bodymass" || key == "cofmass") {
    double ignored = 0.0;
    return numbers(what, &ignored, 1);
  }
  return error(in_quotes(key) + " is not known in a bone");
}

Result<> AsfReader::axis(AsfBone& bone) {
  if (auto ok = numbers("axis of bone '" + bone.name + "'", bone.axis.data(), 3); !ok) return ok;
  const std::string_view word = words_.peek();
  if (word.size() != 3 || lower(word) == "dof") return {};  // XYZ when no order is given
  return order(bone, words_.take());
}

Result<> AsfReader::order(AsfBone& bone, std::string_view word) {
  std::string sorted = lower(word);
  std::ranges::sort(sorted);
  if (sorted != "xyz") return error("the order of an axis is XYZ or alike, not " + in_quotes(word));
  bone.axis_order = lower(word);
  return {};
}

Result<> AsfReader::dof(AsfBone& bone) {
  constexpr std::array<std::string_view, 6> kKnown{"rx", "ry", "rz", "tx", "ty", "tz"};
  while (std::ranges::find(kKnown, lower(words_.peek())) != kKnown.end()) {
    const std::string token = lower(words_.take());
    if (std::ranges::find(bone.dof, token) != bone.dof.end()) {
      return error(in_quotes(token) + " twice in the dof of '" + bone.name + "'");
    }
    bone.dof.push_back(token);
  }
  if (lower(words_.peek()) == "l") {
    (void)words_.take();
    return error("bone '" + bone.name +
                 "' has the dof 'l' (it stretches), which posed cannot play");
  }
  return {};
}

Result<> AsfReader::limits(AsfBone& bone) {
  const auto limit = [this]() -> std::optional<double> {
    const std::string word = lower(words_.peek());
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    if (word == "inf" || word == "+inf") return kInfinity;
    if (word == "-inf") return -kInfinity;
    return parse_number(word);
  };
  while (const auto low = limit()) {
    (void)words_.take();
    const auto high = limit();
    if (!high) return error("limits of bone '" + bone.name + "' should come in pairs");
    (void)words_.take();
    bone.limits.push_back({*low, *high});
  }
  return {};
}

// Reads the lines between begin and end; each names a parent and its children.
Result<> AsfReader::hierarchy() {
  has_hierarchy_ = true;
  if (lower(words_.take()) != "begin") return error("'begin' should follow :hierarchy");
  while (lower(words_.peek()) != "end") {
    if (words_.peek().empty()) return error("the file ends inside :hierarchy");
    const std::string_view parent = words_.take();
    const int line = words_.line();
    const auto at = index_.find(parent);
    if (at == index_.end())
      return error("the hierarchy names " + in_quotes(parent) + ", which is no bone");
    while (!words_.peek().empty() && words_.next_line_number() == line) {
      if (auto ok = link(file_.bones[at->second], words_.take()); !ok) return ok;
    }
  }
  (void)words_.take();
  return {};
}

Result<> AsfReader::link(AsfBone& parent, std::string_view child) {
  const auto at = index_.find(child);
  if (at == index_.end())
    return error("the hierarchy names " + in_quotes(child) + ", which is no bone");
  AsfBone& bone = file_.bones[at->second];
  if (bone.has_parent) return error("bone " + in_quotes(child) + " has two parents");
  bone.has_parent = true;
  parent.children.push_back(at->second);
  return {};
}

}  // namespace

Result<Acclaim> parse_asf(std::string_view text, const std::string& name) {
  return AsfReader(text, name).read();
}

}  // namespace posed::clip
