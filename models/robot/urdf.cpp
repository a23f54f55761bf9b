#include "models/robot/urdf.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <sstream>
#include <utility>

#include <pugixml.hpp>

#include "proto/text/clean.hpp"

namespace posed::robot {
namespace {

constexpr int kMaxDepth = 32;
constexpr double kMaxLength_m = 10.0;
constexpr double kMaxAngle_rad = 100.0;
constexpr double kMaxLimit_rad = 6.3;  // a turn
constexpr double kMaxRead = 1e6;       // of a limit, which may be in degrees
constexpr double kMaxAxis = 1e6;       // it has a direction, not a length

struct RawJoint {
  Link link;  // without a parent and a leader
  std::string parent, child, leader;
};

struct RawUrdf {
  std::map<std::string, Link> links;  // with shapes
  std::vector<std::string> order;     // of links in the file
  std::vector<RawJoint> joints;
};

// The numbers of a text, exactly `count` of them, none beyond `most`.
template <std::size_t count>
std::optional<std::array<double, count>> numbers(std::string_view text, double most) {
  std::array<double, count> values{};
  const char* at = text.data();
  const char* const end = at + text.size();
  const auto skip = [&] {
    while (at != end && (*at == ' ' || *at == '\t' || *at == '\n' || *at == '\r')) ++at;
  };
  for (double& value : values) {
    skip();
    if (at != end && *at == '+') ++at;
    const auto read = std::from_chars(at, end, value);
    if (read.ec != std::errc() || !std::isfinite(value) || std::abs(value) > most)
      return std::nullopt;
    at = read.ptr;
  }
  skip();
  if (at != end) return std::nullopt;
  return values;
}

class Reader {
 public:
  Reader(const pugi::xml_document& document, std::string file)
      : document_(document), file_(std::move(file)) {}

  Result<RawUrdf> read() {
    TRY(check_nodes());
    const pugi::xml_node robot = document_.child("robot");
    if (!robot) return refuse("it has no <robot>: it is no URDF");
    if (robot.next_sibling("robot")) return refuse("it has two <robot>; give each its own file");
    RawUrdf raw;
    for (const pugi::xml_node node : robot.children("link")) TRY(read_link(node, raw));
    for (const pugi::xml_node node : robot.children("joint")) {
      if (raw.joints.size() >= static_cast<std::size_t>(kMaxUrdfLinks)) {
        return refuse("it has more than 1000 joints; a hand has fewer than 100");
      }
      auto joint = TRY(read_joint(node));
      raw.joints.push_back(std::move(joint));
    }
    return raw;
  }

  [[nodiscard]] std::unexpected<Error> refuse(const std::string& sentence) const {
    return fail(sentence, file_);
  }

 private:
  // Of all elements: how deep they are, and whether they are still xacro.
  Result<> check_nodes() const {
    int depth = 0;
    pugi::xml_node node = document_.first_child();
    while (node) {
      TRY(check_expanded(node));
      if (node.first_child()) {
        node = node.first_child();
        if (++depth > kMaxDepth) return refuse("its elements are nested deeper than a URDF's");
        continue;
      }
      while (node && !node.next_sibling()) {
        node = node.parent();
        --depth;
      }
      if (node) node = node.next_sibling();
    }
    return {};
  }

  Result<> check_expanded(const pugi::xml_node& node) const {
    const auto is_xacro = [](std::string_view text) {
      return text.find("${") != text.npos || text.find("$(") != text.npos;
    };
    bool found = std::string_view(node.name()).starts_with("xacro:");
    for (const pugi::xml_attribute& one : node.attributes()) found = found || is_xacro(one.value());
    if (!found) return {};
    return refuse("its <" + clean(node.name()) +
                  "> is xacro: make the URDF with `xacro IN > OUT` and give posed OUT");
  }

  Result<std::string> name_of(const pugi::xml_node& node, const char* what) const {
    std::string name = node.attribute("name").value();
    if (name.empty() || name.size() > 100 || clean(name) != name) {
      return refuse(std::string("a ") + what +
                    " has no name of up to 100 printable characters; give it one");
    }
    return name;
  }

  // What does not say it is at the origin.
  Result<Eigen::Isometry3d> origin(const pugi::xml_node& node, const std::string& owner) const {
    const pugi::xml_node at = node.child("origin");
    const auto xyz = numbers<3>(at.attribute("xyz").as_string("0 0 0"), kMaxLength_m);
    const auto rpy = numbers<3>(at.attribute("rpy").as_string("0 0 0"), kMaxAngle_rad);
    if (!xyz || !rpy) {
      return refuse("the origin of " + in_quotes(owner) +
                    " is not three lengths up to 10 m and three angles; a URDF is in metres and "
                    "radians: scale one that is in millimetres by 0.001");
    }
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Eigen::Vector3d(xyz->data());
    pose.linear() = turn_of_rpy(Eigen::Vector3d(rpy->data()));
    return pose;
  }

  Result<> read_link(const pugi::xml_node& node, RawUrdf& raw) const {
    Link link;
    auto name = TRY(name_of(node, "link"));
    link.name = name;
    if (raw.order.size() >= static_cast<std::size_t>(kMaxUrdfLinks)) {
      return refuse("it has more than 1000 links; a hand has fewer than 100");
    }
    for (const pugi::xml_node collision : node.children("collision")) {
      const auto shape = TRY(read_shape(collision, name));
      if (shape) {
        link.shapes.push_back(*shape);
      } else {
        std::string why = collision.child("geometry").child("mesh").attribute("unused").value();
        link.unused_meshes.push_back(clean(why.substr(0, 200)));
      }
      if (link.shapes.size() > 200) return refuse("link " + in_quotes(name) + " has 200 shapes");
    }
    if (!raw.links.emplace(name, std::move(link)).second) {
      return refuse("two links are named " + in_quotes(name) + "; give each its own name");
    }
    raw.order.push_back(std::move(name));
    return {};
  }

  // Empty: a mesh that load_urdf() did not find.
  Result<std::optional<Shape>> read_shape(const pugi::xml_node& collision,
                                          const std::string& owner) const {
    Shape shape;
    shape.at = TRY(origin(collision, owner));
    const pugi::xml_node geometry = collision.child("geometry");
    const auto edges = [&](const char* kind) {
      return numbers<3>(geometry.child(kind).attribute("size").value(), kMaxLength_m);
    };
    const auto round = [&](const char* kind) {
      const pugi::xml_node node = geometry.child(kind);
      const auto radius = numbers<1>(node.attribute("radius").value(), kMaxLength_m);
      const auto length = numbers<1>(node.attribute("length").as_string("0"), kMaxLength_m);
      if (!radius || !length) return std::optional<std::array<double, 3>>();
      return std::optional(std::array{(*radius)[0], (*length)[0], 0.0});
    };
    if (geometry.child("mesh")) return std::optional<Shape>();
    std::optional<std::array<double, 3>> size;
    if (geometry.child("box")) {
      size = edges("box");
    } else if (geometry.child("cylinder")) {
      shape.kind = Shape::Kind::kCylinder;
      size = round("cylinder");
    } else if (geometry.child("capsule")) {
      shape.kind = Shape::Kind::kCapsule;
      size = round("capsule");
    } else if (geometry.child("sphere")) {
      shape.kind = Shape::Kind::kSphere;
      size = round("sphere");
    }
    if (!size || std::ranges::min(*size) < 0.0 || !((*size)[0] > 0.0)) {
      return refuse("a collision shape of link " + in_quotes(owner) +
                    " is no box, cylinder, capsule or sphere of a size above zero and up to 10 m");
    }
    shape.size_m = Eigen::Vector3d(size->data());
    if (geometry.child("hull")) shape.hull = TRY(read_hull(geometry.child("hull"), owner));
    return std::optional(shape);
  }

  Result<Hull> read_hull(const pugi::xml_node& node, const std::string& owner) const {
    Hull hull;
    const auto radius = numbers<1>(node.attribute("radius").value(), kMaxLength_m);
    std::istringstream corners(node.attribute("corners").value());
    bool good = radius && (*radius)[0] >= 0.0;
    for (std::string x, y, z; good && corners >> x;) {
      corners >> y >> z;
      const auto corner = numbers<3>(x + ' ' + y + ' ' + z, kMaxLength_m);
      good = corners && corner && hull.corners.size() < kMaxHullCorners;
      if (good) hull.corners.emplace_back(corner->data());
    }
    if (!good || hull.corners.empty()) {
      return refuse("the <hull> of link " + in_quotes(owner) +
                    " is not a radius and up to 64 corners within 10 m");
    }
    hull.radius_m = (*radius)[0];
    return hull;
  }

  Result<RawJoint> read_joint(const pugi::xml_node& node) const {
    RawJoint joint;
    Link& link = joint.link;
    link.joint = TRY(name_of(node, "joint"));
    const std::string name = in_quotes(link.joint);
    joint.parent = node.child("parent").attribute("link").value();
    joint.child = node.child("child").attribute("link").value();
    link.at = TRY(origin(node, link.joint));
    const std::string_view type = node.attribute("type").value();
    if (type == "fixed") return joint;
    if (type == "prismatic" || type == "planar" || type == "floating") {
      link.slides = true;
      return joint;
    }
    if (type != "revolute" && type != "continuous") {
      return refuse("joint " + name + " is of type " + in_quotes(std::string(type)) +
                    ", which no URDF has; a joint that turns is revolute or continuous");
    }
    link.turns = true;
    const auto axis = numbers<3>(node.child("axis").attribute("xyz").as_string("1 0 0"), kMaxAxis);
    link.axis = axis ? Eigen::Vector3d(axis->data()) : Eigen::Vector3d::Zero();
    if (!(link.axis.norm() > 1e-6)) return refuse("the axis of joint " + name + " is no direction");
    link.axis.normalize();
    link.endless = type == "continuous";
    TRY(read_limits(node, link));
    TRY(read_mimic(node, joint));
    return joint;
  }

  Result<> read_limits(const pugi::xml_node& node, Link& link) const {
    const pugi::xml_node limit = node.child("limit");
    const std::string name = in_quotes(link.joint);
    if (link.endless) {
      link.low = -std::numbers::pi;
      link.high = std::numbers::pi;
    } else {
      if (!limit) return refuse("joint " + name + " has no <limit>; add its lower and upper");
      const auto low = numbers<1>(limit.attribute("lower").as_string("0"), kMaxRead);
      const auto high = numbers<1>(limit.attribute("upper").as_string("0"), kMaxRead);
      if (!low || !high) return refuse("the limits of joint " + name + " are not angles");
      if ((*low)[0] > (*high)[0]) {
        return refuse("the lower limit of joint " + name + " is above its upper limit");
      }
      if ((*low)[0] < -kMaxLimit_rad || (*high)[0] > kMaxLimit_rad) {
        return refuse("the limits of joint " + name +
                      " are more than a turn; a URDF is in radians, and a joint without an end is "
                      "\"continuous\"");
      }
      link.low = (*low)[0];
      link.high = (*high)[0];
      link.unlimited = !limit.attribute("lower") && !limit.attribute("upper");
    }
    const auto speed = numbers<1>(limit.attribute("velocity").as_string("0"), 1e6);
    if (!speed || (*speed)[0] < 0.0) {
      return refuse("the velocity of joint " + name + " is not a speed");
    }
    link.speed = (*speed)[0];
    return {};
  }

  Result<> read_mimic(const pugi::xml_node& node, RawJoint& joint) const {
    const pugi::xml_node mimic = node.child("mimic");
    if (!mimic) return {};
    joint.leader = mimic.attribute("joint").value();
    const auto multiplier = numbers<1>(mimic.attribute("multiplier").as_string("1"), 1000.0);
    const auto offset = numbers<1>(mimic.attribute("offset").as_string("0"), kMaxAngle_rad);
    if (joint.leader.empty() || !multiplier || !offset) {
      return refuse("the <mimic> of joint " + in_quotes(joint.link.joint) +
                    " is not a joint, a multiplier and an offset");
    }
    joint.link.multiplier = (*multiplier)[0];
    joint.link.offset = (*offset)[0];
    if (joint.link.unlimited) {
      joint.link.low = -std::numbers::pi;
      joint.link.high = std::numbers::pi;
    }
    return {};
  }

  const pugi::xml_document& document_;
  std::string file_;
};

// Puts the links into tree order.
Result<Urdf> build_tree(RawUrdf& raw, const Reader& reader) {
  std::map<std::string, const RawJoint*> carrier;
  std::map<std::string, std::vector<const RawJoint*>> children;
  std::map<std::string, int> names;
  for (const RawJoint& joint : raw.joints) {
    const std::string name = in_quotes(joint.link.joint);
    if (++names[joint.link.joint] > 1) return reader.refuse("two joints are named " + name);
    for (const std::string& link : {joint.parent, joint.child}) {
      if (!raw.links.contains(link)) {
        return reader.refuse("joint " + name + " names the link " + in_quotes(link) +
                             ", which is not there");
      }
    }
    if (!carrier.emplace(joint.child, &joint).second) {
      return reader.refuse("link " + in_quotes(joint.child) + " has two parents");
    }
    children[joint.parent].push_back(&joint);
  }
  std::string root;
  for (const std::string& name : raw.order) {
    if (carrier.contains(name)) continue;
    if (!root.empty()) {
      return reader.refuse("links " + in_quotes(root) + " and " + in_quotes(name) +
                           " both have no parent; connect them by a joint");
    }
    root = name;
  }
  if (root.empty()) return reader.refuse("its links form a cycle");
  Urdf urdf;
  struct Next {
    const RawJoint* joint;
    int parent;
  };
  std::vector<Next> stack;
  urdf.links.push_back(std::move(raw.links.at(root)));
  const auto push_children = [&](const std::string& name, int index) {
    auto& all = children[name];
    for (auto at = all.rbegin(); at != all.rend(); ++at) stack.push_back({*at, index});
  };
  push_children(root, 0);
  while (!stack.empty()) {
    const Next next = stack.back();
    stack.pop_back();
    Link link = next.joint->link;
    Link& bare = raw.links.at(next.joint->child);
    link.name = bare.name;
    link.shapes = std::move(bare.shapes);
    link.unused_meshes = std::move(bare.unused_meshes);
    link.parent = next.parent;
    urdf.links.push_back(std::move(link));
    push_children(next.joint->child, static_cast<int>(urdf.links.size()) - 1);
  }
  if (urdf.links.size() != raw.order.size()) return reader.refuse("its links form a cycle");
  return urdf;
}

// Chains of followers end at the one who follows nobody.
Result<> resolve_leaders(const RawUrdf& raw, Urdf& urdf, const Reader& reader) {
  std::map<std::string, int> index;
  std::map<std::string, std::string> leader;
  for (int l = 1; l < std::ssize(urdf.links); ++l) index[urdf.links[l].joint] = l;
  for (const RawJoint& joint : raw.joints) {
    if (!joint.leader.empty()) leader[joint.link.joint] = joint.leader;
  }
  std::vector<Link> own = urdf.links;
  for (Link& link : urdf.links) {
    if (!leader.contains(link.joint)) continue;
    std::string at = link.joint;
    double multiplier = 1.0, offset = 0.0;
    bool stands = false;  // as the sliding joint does that it follows
    for (int steps = 0; leader.contains(at); ++steps) {
      const Link& here = own[index.at(at)];
      offset += multiplier * here.offset;
      multiplier *= here.multiplier;
      at = leader.at(at);
      const auto found = index.find(at);
      stands = found != index.end() && own[found->second].slides;
      if (stands) break;
      if (found == index.end() || !own[found->second].turns) {
        return reader.refuse("joint " + in_quotes(link.joint) + " follows " + in_quotes(at) +
                             ", which is no joint that turns");
      }
      if (steps > std::ssize(own)) {
        return reader.refuse("joint " + in_quotes(link.joint) + " follows itself");
      }
    }
    if (!std::isfinite(multiplier) || !std::isfinite(offset) || std::abs(multiplier) > 1e3) {
      return reader.refuse("joint " + in_quotes(link.joint) + " turns a thousand times its leader");
    }
    if (stands) {
      if (link.turns) link.at.rotate(Eigen::AngleAxisd(offset, link.axis));
      link.slides = true;
      link.turns = false;
      continue;
    }
    link.leader = index.at(at);
    link.multiplier = multiplier;
    link.offset = offset;
  }
  return {};
}

}  // namespace

Result<Urdf> parse_urdf(std::string_view text, const std::string& file) {
  if (text.size() > kMaxUrdfBytes) return fail("it is larger than 4 MB: it is no hand", file);
  if (text.starts_with("version https://git-lfs")) {
    return fail("it is a pointer of git-lfs: fetch the file by `git lfs pull`", file);
  }
  const bool defines = text.find("<!DOCTYPE") != text.npos || text.find("<!ENTITY") != text.npos;
  if (defines && text.find("<robot") != text.npos) {
    return fail("it defines XML entities, which no URDF needs; remove its <!DOCTYPE>", file);
  }
  pugi::xml_document document;
  const auto parsed = document.load_buffer(text.data(), text.size());
  if (!parsed) return fail(std::string("it is not valid XML: ") + parsed.description(), file);
  Reader reader(document, file);
  auto raw = TRY(reader.read());
  if (raw.order.empty()) return reader.refuse("it has no links: it is no hand");
  auto urdf = TRY(build_tree(raw, reader));
  TRY(resolve_leaders(raw, urdf, reader));
  urdf.name = clean(document.child("robot").attribute("name").as_string("robot"));
  urdf.by_visuals =
      std::string_view(document.child("robot").attribute("shapes").value()) == "visual";
  return urdf;
}

}  // namespace posed::robot
