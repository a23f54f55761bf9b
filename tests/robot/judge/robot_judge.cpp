#include "tests/robot/judge/robot_judge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>

#include <pugixml.hpp>

namespace posed::test {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> words;
  std::istringstream stream(line);
  for (std::string word; std::getline(stream, word, ',');) {
    const auto begin = word.find_first_not_of(" \t\r");
    const auto end = word.find_last_not_of(" \t\r");
    words.push_back(begin == std::string::npos ? "" : word.substr(begin, end - begin + 1));
  }
  return words;
}

// MuJoCo's URDF knows no capsule: a cylinder and two balls.
void split_capsule(pugi::xml_node link, pugi::xml_node collision) {
  pugi::xml_node geometry = collision.child("geometry");
  const pugi::xml_node capsule = geometry.child("capsule");
  if (!capsule) return;
  const std::string radius = capsule.attribute("radius").value();
  const double half = 0.5 * capsule.attribute("length").as_double();
  geometry.remove_child(capsule);
  pugi::xml_node cylinder = geometry.append_child("cylinder");
  cylinder.append_attribute("radius") = radius.c_str();
  cylinder.append_attribute("length") = std::to_string(2.0 * half).c_str();
  const pugi::xml_node at = collision.child("origin");
  std::istringstream xyz(at.attribute("xyz").as_string("0 0 0"));
  std::istringstream rpy(at.attribute("rpy").as_string("0 0 0"));
  double x = 0, y = 0, z = 0, roll = 0, pitch = 0, yaw = 0;
  xyz >> x >> y >> z;
  rpy >> roll >> pitch >> yaw;
  const double along[]{
      std::cos(yaw) * std::sin(pitch) * std::cos(roll) + std::sin(yaw) * std::sin(roll),
      std::sin(yaw) * std::sin(pitch) * std::cos(roll) - std::cos(yaw) * std::sin(roll),
      std::cos(pitch) * std::cos(roll)};
  for (const double end : {-half, half}) {
    pugi::xml_node ball = link.append_child("collision");
    std::ostringstream place;
    place << x + end * along[0] << ' ' << y + end * along[1] << ' ' << z + end * along[2];
    ball.append_child("origin").append_attribute("xyz") = place.str().c_str();
    ball.append_child("geometry").append_child("sphere").append_attribute("radius") =
        radius.c_str();
  }
}

// Makes the shapes of a link such that MuJoCo finds them. Returns how many there are.
int mend_shapes(pugi::xml_node link, const fs::path& folder, std::vector<std::string>& missing) {
  while (link.remove_child("visual")) {
  }
  int shapes = 0;
  for (pugi::xml_node next, one = link.child("collision"); one; one = next) {
    next = one.next_sibling("collision");
    split_capsule(link, one);
    pugi::xml_node mesh = one.child("geometry").child("mesh");
    std::string name = mesh.attribute("filename").value();
    const auto scheme = name.find("://");  // package://NAME/ or file://
    if (scheme != std::string::npos) name = name.substr(name.find('/', scheme + 3) + 1);
    const fs::path file = folder / name;
    const bool readable = file.extension() == ".obj" || file.extension() == ".stl";
    if (mesh && (!readable || !fs::exists(file))) {
      missing.push_back(name);
      link.remove_child(one);
      continue;
    }
    if (mesh) mesh.attribute("filename").set_value(fs::absolute(file).c_str());
    ++shapes;
  }
  return shapes;
}

// Without these MuJoCo refuses real hands, or makes one link of several.
void add_settings(pugi::xml_node robot) {
  pugi::xml_node mujoco = robot.append_child("mujoco"), compiler = mujoco.append_child("compiler");
  for (const auto& [key, value] : {std::pair{"strippath", "false"},
                                   {"fusestatic", "false"},
                                   {"discardvisual", "false"},
                                   {"balanceinertia", "true"},
                                   {"boundmass", "0.001"},
                                   {"boundinertia", "1e-7"}}) {
    compiler.append_attribute(key) = value;
  }
  pugi::xml_node size = mujoco.append_child("size");
  size.append_attribute("nconmax") = "2000";
  size.append_attribute("njmax") = "8000";
}

void note(RobotVerdict::Place& place, double worst) {
  ++place.frames;
  place.worst = std::max(place.worst, worst);
}

}  // namespace

Result<RobotPoses> read_robot_poses(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) return fail("it has no line of joint names", path.string());
  RobotPoses poses{.joints = split(line), .rows = {}};
  for (int number = 2; std::getline(file, line); ++number) {
    if (line.empty()) continue;
    std::vector<double> row;
    for (const std::string& word : split(line)) {
      char* end = nullptr;
      row.push_back(std::strtod(word.c_str(), &end));
      if (word.empty() || *end != 0)
        return fail("'" + word + "' is no number", path.string(), number);
    }
    if (row.size() != poses.joints.size()) {
      return fail("it has another number of columns than the first line", path.string(), number);
    }
    poses.rows.push_back(std::move(row));
  }
  return poses;
}

struct RobotJudge::Prepared {
  std::string text, root;
  int links = 0;
  std::vector<std::string> without_shape, missing;
  std::vector<std::vector<std::string>> mimics;  // joint, leader, multiplier, offset
};

Result<RobotJudge::Prepared> RobotJudge::prepare(const fs::path& urdf) {
  pugi::xml_document document;
  const auto parsed = document.load_file(urdf.c_str());
  if (!parsed) return fail(parsed.description(), urdf.string());
  Prepared made;
  pugi::xml_node robot = document.child("robot");
  std::set<std::string> children;
  for (pugi::xml_node joint : robot.children("joint")) {
    children.insert(joint.child("child").attribute("link").value());
    const pugi::xml_node mimic = joint.child("mimic");
    if (!mimic) continue;
    made.mimics.push_back({joint.attribute("name").value(), mimic.attribute("joint").value(),
                           mimic.attribute("multiplier").as_string("1"),
                           mimic.attribute("offset").as_string("0")});
  }
  for (pugi::xml_node link : robot.children("link")) {
    const std::string name = link.attribute("name").value();
    ++made.links;
    if (!children.contains(name)) made.root = name;
    if (mend_shapes(link, urdf.parent_path(), made.missing) == 0)
      made.without_shape.push_back(name);
  }
  if (made.links == 0) return fail("it is no URDF of a robot", urdf.string());
  add_settings(robot);
  std::ostringstream text;
  document.save(text);
  made.text = text.str();
  return made;
}

Result<RobotJudge> RobotJudge::load(const fs::path& urdf) {
  Prepared made = TRY(prepare(urdf));
  const auto files = std::make_unique<mjVFS>();
  ::mj_defaultVFS(files.get());
  ::mj_makeEmptyFileVFS(files.get(), "hand.urdf", static_cast<int>(made.text.size()));
  std::memcpy(files->filedata[0], made.text.data(), made.text.size());
  std::array<char, 1024> error{};
  mjModel* model = ::mj_loadXML("hand.urdf", files.get(), error.data(), error.size());
  ::mj_deleteVFS(files.get());
  if (model == nullptr) return fail(std::string("MuJoCo: ") + error.data(), urdf.string());
  RobotJudge judge;
  judge.model_ = {model, &::mj_deleteModel};
  judge.data_ = {::mj_makeData(model), &::mj_deleteData};
  judge.root_ = std::move(made.root);
  judge.links_ = made.links;
  judge.without_shape_ = std::move(made.without_shape);
  judge.missing_ = std::move(made.missing);
  TRY(judge.find_followers(made.mimics));
  judge.set_pose({});
  for (const auto& [pair, depth_m] : judge.contacts()) judge.at_start_.insert(pair);
  return judge;
}

// MuJoCo ignores mimic.
Result<> RobotJudge::find_followers(const std::vector<std::vector<std::string>>& mimics) {
  std::set<int> waiting;
  std::vector<Follower> all;
  for (const auto& mimic : mimics) {
    const int joint = ::mj_name2id(model_.get(), mjOBJ_JOINT, mimic[0].c_str());
    const int leader = ::mj_name2id(model_.get(), mjOBJ_JOINT, mimic[1].c_str());
    if (joint < 0 || leader < 0) return fail("joint " + mimic[0] + " follows none of the robot's");
    all.push_back({joint, leader, std::stod(mimic[2]), std::stod(mimic[3])});
    waiting.insert(joint);
  }
  while (!all.empty()) {
    const auto next = std::ranges::find_if(
        all, [&](const Follower& one) { return !waiting.contains(one.leader); });
    if (next == all.end()) return fail("joints follow each other in a circle");
    waiting.erase(next->joint);
    followers_.push_back(*next);
    all.erase(next);
  }
  return {};
}

double RobotJudge::start_of(int joint) const {
  if (!model_->jnt_limited[joint]) return 0.0;
  return std::clamp(0.0, model_->jnt_range[2 * joint], model_->jnt_range[2 * joint + 1]);
}

void RobotJudge::set_pose(const std::map<int, double>& values) {
  mjtNum* q = data_->qpos;
  for (int j = 0; j < model_->njnt; ++j) {
    const auto value = values.find(j);
    q[model_->jnt_qposadr[j]] = value == values.end() ? start_of(j) : value->second;
  }
  for (const Follower& one : followers_) {
    q[model_->jnt_qposadr[one.joint]] =
        one.multiplier * q[model_->jnt_qposadr[one.leader]] + one.offset;
  }
}

// The deepest of each pair that no joint connects.
std::map<RobotJudge::Pair, double> RobotJudge::contacts() {
  ::mj_kinematics(model_.get(), data_.get());
  ::mj_comPos(model_.get(), data_.get());
  ::mj_collision(model_.get(), data_.get());
  std::map<Pair, double> deepest;
  for (int i = 0; i < data_->ncon; ++i) {
    const mjContact& contact = data_->contact[i];
    if (contact.dist > -kDepth_m) continue;
    const int one = model_->geom_bodyid[contact.geom1], two = model_->geom_bodyid[contact.geom2];
    // MuJoCo itself leaves these out unless the parent is the world, the hand's root.
    const int weld_one = model_->body_weldid[one], weld_two = model_->body_weldid[two];
    const auto parent = [&](int body) { return model_->body_weldid[model_->body_parentid[body]]; };
    if (parent(weld_one) == weld_two || parent(weld_two) == weld_one) continue;
    double& depth_m = deepest[std::minmax(one, two)];
    depth_m = std::max(depth_m, -contact.dist);
  }
  return deepest;
}

std::string RobotJudge::link_name(int body) const {
  return body == 0 ? root_ : ::mj_id2name(model_.get(), mjOBJ_BODY, body);
}

std::vector<std::string> RobotJudge::touching_at_start() const {
  std::vector<std::string> all;
  for (const auto& [one, two] : at_start_) all.push_back(link_name(one) + " + " + link_name(two));
  return all;
}

void RobotJudge::judge_limits(bool numbers, RobotVerdict& verdict) const {
  bool beyond = !numbers;
  for (int j = 0; j < model_->njnt; ++j) {
    if (!model_->jnt_limited[j]) continue;
    const double q = data_->qpos[model_->jnt_qposadr[j]];
    const double by = std::max(model_->jnt_range[2 * j] - q, q - model_->jnt_range[2 * j + 1]);
    if (by <= kBeyond) continue;
    note(verdict.limits[::mj_id2name(model_.get(), mjOBJ_JOINT, j)], by);
    beyond = true;
  }
  verdict.beyond_limits += beyond ? 1 : 0;
}

RobotVerdict RobotJudge::judge(const RobotPoses& poses) {
  RobotVerdict verdict;
  verdict.frames = static_cast<int>(poses.rows.size());
  std::vector<int> joint_of;
  std::set<int> moved;
  for (const std::string& name : poses.joints) {
    joint_of.push_back(::mj_name2id(model_.get(), mjOBJ_JOINT, name.c_str()));
    moved.insert(joint_of.back());
    if (joint_of.back() < 0) verdict.unknown_columns.push_back(name);
  }
  for (const Follower& one : followers_) moved.insert(one.joint);
  for (int j = 0; j < model_->njnt; ++j) {
    if (!moved.contains(j)) {
      verdict.still_joints.emplace_back(::mj_id2name(model_.get(), mjOBJ_JOINT, j));
    }
  }
  for (const auto& row : poses.rows) {
    std::map<int, double> values;
    bool numbers = true;
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (joint_of[i] < 0) continue;
      numbers = numbers && std::isfinite(row[i]);
      if (std::isfinite(row[i])) values[joint_of[i]] = row[i];
    }
    set_pose(values);
    judge_limits(numbers, verdict);
    bool touches = false;
    for (const auto& [pair, depth_m] : contacts()) {
      if (at_start_.contains(pair)) continue;
      note(verdict.contacts[{link_name(pair.first), link_name(pair.second)}], depth_m);
      touches = true;
    }
    verdict.in_contact += touches ? 1 : 0;
  }
  return verdict;
}

}  // namespace posed::test
