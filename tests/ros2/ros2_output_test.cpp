// The output `ros2` read by another implementation of DDS, in another process.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <deque>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <ifaddrs.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "daemon/output/ros2/dds.hpp"
#include "tests/support/process.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/daemon/output/output_rig.hpp"

namespace posed::output {
namespace {

using Json = nlohmann::json;
using namespace std::chrono_literals;

constexpr int kDomain = 77;  // a ROS of this machine has another

config::OutputConfig ros2_config(std::vector<std::string> streams) {
  config::OutputConfig config;
  config.kind = config::OutputKind::kRos2;
  config.bodies = std::move(streams);
  config.domain = kDomain;
  return config;
}

// A palm and two joints of a finger, each with one channel; a thumb with two.
std::shared_ptr<const Skeleton> finger() {
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->name = "finger";
  const auto add = [&](const char* name, int parent, const Eigen::Vector3d& offset_m) {
    Joint& joint = skeleton->joints.emplace_back();
    joint.name = name;
    joint.parent = parent;
    joint.offset_m = offset_m;
  };
  add("palm", -1, {0.0, 0.0, 0.0});
  add("joint_0.0", 0, {0.01, 0.02, 0.1});
  add("joint_1.0", 1, {0.0, 0.0, 0.05});
  add("thumb", 0, {0.03, 0.0, 0.0});
  skeleton->channels = {{.joint = 1, .axis = Axis::kX},
                        {.joint = 2, .axis = Axis::kX, .follows = true},
                        {.joint = 3, .axis = Axis::kY},
                        {.joint = 3, .axis = Axis::kZ}};
  REQUIRE(skeleton->finish());
  return skeleton;
}

Frame pose_of(const Skeleton& skeleton, double angle_rad, RobotState robot = RobotState::kNone) {
  Frame frame;
  pose_from_channels(skeleton, std::vector<double>{angle_rad, 0.2, 0.3, -0.4}, frame);
  frame.root_position_m = {1.0F, 2.0F, 3.0F};
  frame.robot = robot;
  frame.velocity_rad_s = {0.5F, -0.5F, 0.0F, 0.25F};
  return frame;
}

class Reader {
 public:
  Reader(const std::string& topic, const std::string& type, const std::string& lifespan_ms = {})
      : process_(test::Command(words(topic, type, lifespan_ms))) {}

  // The next line that has this key; null if none comes in time.
  [[nodiscard]] Json line(const std::string& key, std::chrono::milliseconds patience = 60s) {
    while (true) {
      const auto found =
          std::ranges::find_if(lines_, [&](const Json& line) { return line.contains(key); });
      if (found != lines_.end()) {
        Json line = std::move(*found);
        lines_.erase(found);
        return line;
      }
      const auto text = process_.line(patience);
      if (!text) return {};
      lines_.push_back(Json::parse(*text));
    }
  }
  void signal(int number) const { process_.send(number); }

 private:
  static std::vector<std::string> words(const std::string& topic, const std::string& type,
                                        const std::string& lifespan_ms) {
    std::vector<std::string> all{POSED_ROS2_READER, std::to_string(kDomain), topic, type};
    if (!lifespan_ms.empty()) all.push_back(lifespan_ms);
    return all;
  }
  test::Process process_;
  std::deque<Json> lines_;  // that nobody has asked for yet
};

struct Ros2Rig : OutputRig {
  explicit Ros2Rig(const config::OutputConfig& config) : OutputRig(config) {
    output->stream_comes(info_of(0, config.bodies[0], skeleton));
  }
  void pass(double angle_rad, RobotState robot = RobotState::kNone) {
    OutputRig::pass(frame_of(0, pose_of(*skeleton, angle_rad, robot)), system::monotonic_ns());
  }
  // Both sides know each other.
  [[nodiscard]] bool meets(int readers, RobotState robot = RobotState::kNone) {
    for (int i = 0; i < 600; ++i) {
      pass(0.0, robot);
      now_ns += 2 * kNanosPerSecond;
      static_cast<void>(output->turn(system::monotonic_ns() + now_ns));  // it counts each second
      if (static_cast<int>(stats().receivers()) >= readers) return true;
      std::this_thread::sleep_for(50ms);
    }
    return false;
  }
  std::shared_ptr<const Skeleton> skeleton = finger();
  std::int64_t now_ns = 0;
};

}  // namespace

TEST_CASE("Fast DDS reads each command of a robot that somebody has engaged, and no other") {
  Ros2Rig rig(ros2_config({"left-hand"}));
  Reader reader("posed/left_hand/joint_commands", "JointState");
  REQUIRE(rig.meets(1, RobotState::kReleased));
  const Json writer = reader.line("user_data");
  CHECK(writer["user_data"] == std::string("typehash=") + kJointState.hash + ";");
  CHECK(writer["reliable"] == true);
  CHECK(writer["volatile"] == true);
  CHECK(writer["lifespan_ns"] == DdsWriter::kLifespan_ns);
  REQUIRE(reader.line("writers")["writers"] == 1);
  CHECK(rig.stats().sent() == 0);
  for (int i = 1; i <= 50; ++i) {
    const double angle_rad = 0.01 * i;
    rig.pass(-1.0, RobotState::kReleased);
    rig.pass(angle_rad, i % 2 == 0 ? RobotState::kHolding : RobotState::kEngaged);
    const Json sample = reader.line("name");
    REQUIRE(sample["name"] == Json({"joint_0.0", "joint_1.0", "thumb_y", "thumb_z"}));
    REQUIRE(sample["position"][0].get<double>() == Approx(angle_rad));
    REQUIRE(sample["position"][3].get<double>() == Approx(-0.4));
    REQUIRE(sample["velocity"] == Json({0.5, -0.5, 0.0, 0.25}));
    REQUIRE(sample["effort"].empty());
    REQUIRE(sample["age_ns"].get<std::int64_t>() >= 0);
    REQUIRE(sample["age_ns"].get<std::int64_t>() < 60 * kNanosPerSecond);  // the clock of walls
  }
  CHECK(rig.stats().sent() == 50);
  CHECK(rig.stats().failures() == 0);
  CHECK(rig.reported.empty());
}

TEST_CASE("Fast DDS reads a controller's trajectory on the topic of the config") {
  auto config = ros2_config({"hand"});
  config.trajectory = true;
  config.topic = "hand_controller/joint_trajectory";
  Ros2Rig rig(config);
  Reader reader(config.topic, "JointTrajectory");
  REQUIRE(rig.meets(1, RobotState::kReleased));
  REQUIRE(reader.line("writers")["writers"] == 1);
  rig.pass(0.7, RobotState::kEngaged);
  const Json sample = reader.line("name");
  // Controllers refuse a joint that they do not drive.
  CHECK(sample["name"] == Json({"joint_0.0", "thumb_y", "thumb_z"}));
  REQUIRE(sample["points"].size() == 1);
  const Json& point = sample["points"][0];
  REQUIRE(point["positions"].size() == 3);
  CHECK(point["positions"][0].get<double>() == Approx(0.7));
  CHECK(point["positions"][1].get<double>() == Approx(0.3));
  CHECK(point["velocities"].empty());  // or controllers refuse an end that moves
  CHECK(point["time_ns"] == 20'000'000);
}

TEST_CASE("Fast DDS reads the frames and angles of a hand in the axes of ROS") {
  Ros2Rig rig(ros2_config({"2nd-hand"}));
  Reader frames("tf", "TFMessage");
  Reader angles("posed/s2nd_hand/joint_states", "JointState");
  REQUIRE(rig.meets(2));
  REQUIRE(frames.line("writers")["writers"] == 1);
  REQUIRE(angles.line("writers")["writers"] == 1);
  rig.pass(0.5);
  Json sample;
  do {
    sample = angles.line("name");
    REQUIRE(!sample.is_null());
  } while (sample["position"][0].get<double>() < 0.4);
  CHECK(sample["velocity"].empty());
  Json moved;
  do {
    const Json line = frames.line("transforms");
    REQUIRE(!line.is_null());
    moved = line["transforms"];
  } while (std::abs(moved[1]["turn"]["y"].get<double>()) < 0.1);
  REQUIRE(moved.size() == 4);
  CHECK(moved[0]["frame_id"] == "world");
  CHECK(moved[0]["child"] == "2nd-hand/palm");
  CHECK(moved[0]["at"] == Json({{"x", 3.0}, {"y", 1.0}, {"z", 2.0}}));  // forward, left, up
  CHECK(moved[2]["frame_id"] == "2nd-hand/joint_0.0");
  CHECK(moved[1]["at"]["x"].get<double>() == Approx(0.1));
  CHECK(moved[1]["at"]["y"].get<double>() == Approx(0.01));
  CHECK(moved[1]["at"]["z"].get<double>() == Approx(0.02));
  // A turn about posed's x, the left, is one about ROS's y.
  CHECK(moved[1]["turn"]["y"].get<double>() == Approx(std::sin(0.25)));
  CHECK(moved[1]["turn"]["w"].get<double>() == Approx(std::cos(0.25)));
}

// The reader asks for the lifespan, as Cyclone does by itself and Fast DDS does not.
TEST_CASE("A reader that was stopped for two seconds gets no old command") {
  Ros2Rig rig(ros2_config({"hand"}));
  Reader reader("posed/hand/joint_commands", "JointState", "100");
  REQUIRE(rig.meets(1, RobotState::kReleased));
  REQUIRE(reader.line("writers")["writers"] == 1);
  reader.signal(SIGSTOP);
  for (int i = 0; i < 500; ++i) {
    rig.pass(0.1, RobotState::kEngaged);
    std::this_thread::sleep_for(4ms);
  }
  reader.signal(SIGCONT);
  std::int64_t oldest_ns = 0;
  bool fresh = false;
  for (int i = 0; i < 6000 && !fresh; ++i) {
    rig.pass(0.2, RobotState::kEngaged);
    const Json sample = reader.line("name", 10ms);
    if (sample.is_null()) continue;
    fresh = sample["position"][0].get<double>() > 0.15;
    oldest_ns = std::max(oldest_ns, sample["age_ns"].get<std::int64_t>());
  }
  CHECK(fresh);
  CHECK(oldest_ns < kNanosPerSecond);  // 0.1 s, and time for a busy machine; without: 2 s
}

// Datagrams that the sockets of the domain have refused, or had no room for.
std::int64_t refused() {
  std::int64_t sum = 0;
  std::ifstream file("/proc/net/udp");
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream words(line);
    std::vector<std::string> all;
    for (std::string word; words >> word;) all.push_back(word);
    const int port = std::stoi(all[1].substr(all[1].find(':') + 1), nullptr, 16);
    if (port >= 7400 + 250 * kDomain && port < 7650 + 250 * kDomain) sum += std::stoll(all.back());
  }
  return sum;
}

// An address of this machine that is not on loopback; 0: none.
std::uint32_t outer_address() {
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return 0;
  std::uint32_t found = 0;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    const auto* address = reinterpret_cast<const sockaddr_in*>(one->ifa_addr);
    if ((ntohl(address->sin_addr.s_addr) >> 24) != 127) found = address->sin_addr.s_addr;
  }
  freeifaddrs(all);
  return found;
}

void send_from(std::uint32_t source, int port) {
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = source;
  REQUIRE(bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  REQUIRE(sendto(fd, "RTPS", 4, 0, reinterpret_cast<sockaddr*>(&address), sizeof address) == 4);
  close(fd);
}

TEST_CASE("DDS on loopback hears nobody from outside, though it listens on all addresses") {
  const std::uint32_t outside = outer_address();
  if (outside == 0) {
    WARN("this machine has no address but loopback's: not tested");
    return;
  }
  const Ros2Rig rig(ros2_config({"hand"}));
  const int port = 7400 + 250 * kDomain + 10;
  send_from(htonl(INADDR_LOOPBACK), port);
  CHECK(refused() == 0);
  send_from(outside, port);
  CHECK(refused() == 1);
}

TEST_CASE("Outputs of one domain share it, and another interface is refused") {
  const Ros2Rig first(ros2_config({"ann"}));
  const Ros2Rig second(ros2_config({"bob"}));
  auto config = ros2_config({"eve"});
  config.name = "eve";
  config.interface = "no-such-0";
  const auto other = open_output(config);
  REQUIRE(!other);
  CHECK_THAT(other.error().text(), Catch::Contains("another output has DDS domain 77"));
  config.domain = kDomain + 1;
  const auto absent = open_output(config);
  REQUIRE(!absent);
  CHECK_THAT(absent.error().text(), Catch::Contains("there is no network interface 'no-such-0'"));
}

TEST_CASE("The hashes in the code are those of the IDL") {
  test::Process python(test::Command({"python3", test::source_dir() / "tests/ros2/type_hashes.py",
                                      test::source_dir() / "daemon/output/ros2/messages.idl"}));
  CHECK(python.line() == std::string("sensor_msgs/msg/JointState ") + kJointState.hash);
  CHECK(python.line() ==
        std::string("trajectory_msgs/msg/JointTrajectory ") + kJointTrajectory.hash);
  CHECK(python.line() == std::string("tf2_msgs/msg/TFMessage ") + kTfMessage.hash);
}

// Hidden: its figures depend on the machine.
TEST_CASE("Commands at 500 Hz", "[.][figures]") {
  Ros2Rig rig(ros2_config({"hand"}));
  Reader reader("posed/hand/joint_commands", "JointState");
  REQUIRE(rig.meets(1, RobotState::kReleased));
  constexpr int kCount = 2000;
  std::vector<std::int64_t> ages_ns;
  const auto read_until = [&](auto due) {
    while (std::chrono::steady_clock::now() < due) {
      const Json line = reader.line("name", 2ms);
      if (!line.is_null()) ages_ns.push_back(line["age_ns"].get<std::int64_t>());
    }
  };
  auto due = std::chrono::steady_clock::now();
  for (int i = 1; i <= kCount; ++i) {
    rig.pass(0.001 * i, RobotState::kEngaged);
    read_until(due += 2ms);
  }
  read_until(due + 1s);
  std::ranges::sort(ages_ns);
  const std::size_t count = ages_ns.size();
  REQUIRE(count > 0);
  WARN(count << " of " << kCount << ", latency p50 " << ages_ns[count / 2] / 1000 << " us, p99 "
             << ages_ns[count * 99 / 100] / 1000 << " us, max " << ages_ns.back() / 1000 << " us");
}

}  // namespace posed::output
