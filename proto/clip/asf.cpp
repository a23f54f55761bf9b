// Reads ASF skeletons: words, then bones, then the skeleton.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "proto/clip/acclaim.hpp"
#include "proto/clip/text.hpp"
#include "proto/frame/degree.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/lower.hpp"

namespace posed::clip {
namespace {

// Splits an ASF into words. `#` begins a comment; commas and parentheses count as white space.
class Words {
 public:
  explicit Words(std::string_view text) : text_(without_bom(text)) { fill(); }

  [[nodiscard]] std::string_view peek() const { return word_; }  // empty at the end
  [[nodiscard]] std::string_view next() {
    const std::string_view word = word_;
    line_ = word_line_;
    fill();
    return word;
  }
  [[nodiscard]] int line() const { return line_; }  // line of the word returned last
  [[nodiscard]] int next_line_number() const { return word_line_; }  // line of the next word
  [[nodiscard]] bool starts_section() const { return first_ && word_.starts_with(':'); }

 private:
  [[nodiscard]] static bool is_blank(char c) {
    return is_space(c) || c == ',' || c == '(' || c == ')';
  }

  void fill() {
    first_ = false;
    while (true) {
      while (!rest_.empty() && is_blank(rest_.front())) rest_.remove_prefix(1);
      if (!rest_.empty() && rest_.front() != '#') break;
      if (text_.empty()) {
        word_ = {};
        return;
      }
      rest_ = next_line(text_);
      ++word_line_;
      first_ = true;
    }
    std::size_t end = 0;
    while (end < rest_.size() && !is_blank(rest_[end])) ++end;
    word_ = rest_.substr(0, end);
    rest_.remove_prefix(end);
  }

  std::string_view text_;
  std::string_view rest_;  // rest of the current line
  std::string_view word_;
  int word_line_ = 0;
  int line_ = 1;
  bool first_ = false;  // `word_` is the first on its line
};

struct AsfBone {
  std::string name;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  double length = 0.0;
  std::array<double, 3> axis{};
  std::string axis_order = "xyz";
  std::vector<std::string> dof;
  std::vector<std::array<double, 2>> limits;  // one pair per dof, or empty
  std::vector<int> children;
  bool has_parent = false;
};

struct AsfFile {
  std::vector<AsfBone> bones;  // the root is the first
  Eigen::Vector3d root_position = Eigen::Vector3d::Zero();
  double length_unit = 1.0;  // in inches; 0.45 in CMU's files
  bool degrees = true;
};

constexpr double kInch_m = 0.0254;

// Adds translations in listed order, then the rotations reversed: posed lists the outermost first.
void add_channels(const AsfBone& bone, double radians, Acclaim& out) {
  AcclaimBone values{.name = bone.name, .channels = std::vector<int>(bone.dof.size())};
  const auto add = [&](std::size_t i, bool translation) {
    Channel channel;
    channel.joint = static_cast<std::uint16_t>(out.skeleton.joints.size() - 1);
    channel.axis = static_cast<Axis>(bone.dof[i][1] - 'x');
    channel.translation = translation;
    if (!bone.limits.empty()) {
      const double scale = translation ? out.metres_per_unit : radians;
      channel.min = static_cast<float>(bone.limits[i][0] * scale);
      channel.max = static_cast<float>(bone.limits[i][1] * scale);
    }
    values.channels[i] = static_cast<int>(out.skeleton.channels.size());
    out.skeleton.channels.push_back(channel);
  };
  for (std::size_t i = 0; i < bone.dof.size(); ++i) {
    if (bone.dof[i][0] == 't') add(i, true);
  }
  for (std::size_t i = bone.dof.size(); i-- > 0;) {
    if (bone.dof[i][0] == 'r') add(i, false);
  }
  out.bones.push_back(std::move(values));
}

// Recurses depth first. It ends, because a bone has at most one parent and the root none.
void add_bone(const AsfFile& file, int index, const AsfBone* parent, int parent_joint,
              Acclaim& out) {
  const AsfBone& bone = file.bones[index];
  const double radians = file.degrees ? kDegree : 1.0;
  Joint joint;
  joint.name = bone.name;
  joint.parent = parent_joint;
  joint.offset_m = out.metres_per_unit *
                   (parent != nullptr ? parent->direction * parent->length : file.root_position);
  if (bone.children.empty()) {
    joint.end_site_m = bone.direction * (bone.length * out.metres_per_unit);
  }
  for (std::size_t i = 0; i < bone.axis_order.size(); ++i) {  // the first letter is innermost
    const auto axis = static_cast<Axis>(bone.axis_order[i] - 'x');
    joint.channel_frame = axis_rotation(axis, bone.axis[static_cast<std::size_t>(axis)] * radians) *
                          joint.channel_frame;
  }
  const int here = static_cast<int>(out.skeleton.joints.size());
  out.skeleton.joints.push_back(std::move(joint));
  add_channels(bone, radians, out);
  for (const int child : bone.children) add_bone(file, child, &bone, here, out);
}

Result<Acclaim> acclaim_of(const AsfFile& file, const std::string& name) {
  Acclaim out;
  out.metres_per_unit = kInch_m / file.length_unit;
  out.degrees = file.degrees;
  if (file.bones[0].dof.empty()) {
    return fail("the :root has no order, so nothing places the figure", name);
  }
  add_bone(file, 0, nullptr, -1, out);
  const auto lost = std::ranges::find_if(
      file.bones, [&out](const AsfBone& bone) { return out.skeleton.joint_index(bone.name) < 0; });
  if (lost != file.bones.end()) {
    return fail("bone " + in_quotes(lost->name) + " does not hang on the root in :hierarchy", name);
  }
  return out;
}

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
    (void)words_.next();
    return error("does not begin with a ':' section, so it is not an ASF skeleton");
  }
  while (!words_.peek().empty()) {
    const std::string key = lower(words_.next());
    TRY(section(key));
  }
  if (!has_hierarchy_) return error("has no :hierarchy, so its bones are not joined");
  return acclaim_of(file_, name_);
}

void AsfReader::skip_section() {
  while (!words_.peek().empty() && !words_.starts_section()) (void)words_.next();
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
  const std::string_view word = words_.next();
  const auto value = parse_number(word);
  if (!value) return error(std::string(what) + ": " + in_quotes(word) + " is not a number");
  return *value;
}

Result<> AsfReader::numbers(std::string_view what, double* values, int count) {
  for (int i = 0; i < count; ++i) {
    const auto value = TRY(number(what));
    values[i] = value;
  }
  return {};
}

Result<> AsfReader::units() {
  while (!words_.peek().empty() && !words_.starts_section()) {
    const std::string key = lower(words_.next());
    if (key == "angle") {
      const std::string unit = lower(words_.next());
      if (unit != "deg" && unit != "rad")
        return error("angle is in deg or rad, not " + in_quotes(unit));
      file_.degrees = unit == "deg";
      continue;
    }
    const auto value = TRY(number(key));
    if (key != "length") continue;
    if (!(value > 1e-6)) return error("length should be more than 0; CMU's is 0.45");
    file_.length_unit = value;
  }
  return {};
}

Result<> AsfReader::root() {
  while (!words_.peek().empty() && !words_.starts_section()) {
    const std::string key = lower(words_.next());
    if (key == "order") {
      TRY(dof(file_.bones[0]));
    } else if (key == "axis") {
      TRY(order(file_.bones[0], words_.next()));
    } else if (key == "position") {
      TRY(numbers("position of the root", file_.root_position.data(), 3));
    } else if (key == "orientation") {
      TRY(numbers("orientation of the root", file_.bones[0].axis.data(), 3));
    } else {
      return error(in_quotes(key) + " is not known in :root");
    }
  }
  return {};
}

Result<> AsfReader::bone_data() {
  while (!words_.peek().empty() && !words_.starts_section()) {
    if (lower(words_.next()) != "begin") return error("'begin' should open each bone in :bonedata");
    TRY(bone());
  }
  return {};
}

Result<> AsfReader::bone() {
  AsfBone bone;
  while (true) {
    if (words_.peek().empty() || words_.starts_section()) {
      return error("bone '" + bone.name + "' is not closed by 'end'");
    }
    const std::string key = lower(words_.next());
    if (key == "end") break;
    TRY(bone_entry(bone, key));
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
    bone.name = words_.next();
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
  TRY(numbers("axis of bone '" + bone.name + "'", bone.axis.data(), 3));
  const std::string_view word = words_.peek();
  if (word.size() != 3 || lower(word) == "dof") return {};  // XYZ when no order is given
  return order(bone, words_.next());
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
    const std::string token = lower(words_.next());
    if (std::ranges::find(bone.dof, token) != bone.dof.end()) {
      return error(in_quotes(token) + " twice in the dof of '" + bone.name + "'");
    }
    bone.dof.push_back(token);
  }
  if (lower(words_.peek()) == "l") {
    (void)words_.next();
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
    (void)words_.next();
    const auto high = limit();
    if (!high) return error("limits of bone '" + bone.name + "' should come in pairs");
    (void)words_.next();
    bone.limits.push_back({*low, *high});
  }
  return {};
}

// Reads the lines between begin and end; each names a parent and its children.
Result<> AsfReader::hierarchy() {
  has_hierarchy_ = true;
  if (lower(words_.next()) != "begin") return error("'begin' should follow :hierarchy");
  while (lower(words_.peek()) != "end") {
    if (words_.peek().empty()) return error("the file ends inside :hierarchy");
    const std::string_view parent = words_.next();
    const int line = words_.line();
    const auto at = index_.find(parent);
    if (at == index_.end())
      return error("the hierarchy names " + in_quotes(parent) + ", which is no bone");
    while (!words_.peek().empty() && words_.next_line_number() == line) {
      TRY(link(file_.bones[at->second], words_.next()));
    }
  }
  (void)words_.next();
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
