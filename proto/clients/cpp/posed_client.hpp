// posed_client: a C++ client of posed, the pose daemon, in one header on libzmq and protobuf.
// C++17; compile with the messages that protoc makes of proto/wire/posed/v1/posed.proto, and link
// -lzmq -lprotobuf.
//
//   posed_client::Subscriber subscriber("tcp://127.0.0.1:5570", "walker");
//   while (auto pose = subscriber.next(std::chrono::seconds(1))) {
//     posed_client::World world = posed_client::world_of(*pose);
//   }
//
// Not for several threads at once. Errors are exceptions of std::runtime_error with a sentence.
#pragma once

#include <zmq.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "posed/v1/posed.pb.h"

namespace posed_client {

using Vector = std::array<float, 3>;      // metres; right-handed, Y up
using Quaternion = std::array<float, 4>;  // x, y, z, w

// One's own NAME.key and the daemon's NAME.pub, as `posed keygen` writes them.
struct Keys {
  std::string own_secret_file, server_public_file;
};

struct Pose {
  posed::v1::Frame frame;
  std::shared_ptr<const posed::v1::Skeleton> skeleton;  // that of the frame; never null
};

// Where the joints are in the room: [joint of the skeleton].
struct World {
  std::vector<Quaternion> rotation;
  std::vector<Vector> position_m;
};

// First b, then a.
inline Quaternion multiply(const Quaternion& a, const Quaternion& b) {
  return {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
          a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
          a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
          a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
}

inline Vector rotate(const Quaternion& q, const Vector& v) {
  const Quaternion turned =
      multiply(multiply(q, {v[0], v[1], v[2], 0.0F}), {-q[0], -q[1], -q[2], q[3]});
  return {turned[0], turned[1], turned[2]};
}

inline Vector add(const Vector& a, const Vector& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}

// Forward kinematics. The parents of a skeleton precede their children.
inline World world_of(const Pose& pose) {
  const posed::v1::Skeleton& skeleton = *pose.skeleton;
  World world;
  for (int j = 0; j < skeleton.parent_size(); ++j) {
    const auto& values = pose.frame.rotation_xyzw();
    const Quaternion local{values[4 * j], values[4 * j + 1], values[4 * j + 2], values[4 * j + 3]};
    if (skeleton.parent(j) < 0) {
      world.rotation.push_back(local);
      world.position_m.push_back({});
      continue;
    }
    const std::size_t above = skeleton.parent(j);
    const auto& offsets = skeleton.offset_m();
    const Vector offset{offsets[3 * j], offsets[3 * j + 1], offsets[3 * j + 2]};
    world.position_m.push_back(add(world.position_m[above], rotate(world.rotation[above], offset)));
    world.rotation.push_back(multiply(world.rotation[above], local));
  }
  // A frame says where the skeleton's root joint is.
  const Vector at = world.position_m[skeleton.root_joint()];
  const auto& root = pose.frame.root_position_m();
  for (Vector& place : world.position_m) {
    place = add(place, {root[0] - at[0], root[1] - at[1], root[2] - at[2]});
  }
  return world;
}

class Subscriber {
 public:
  // Connects, now or as soon as the daemon is there.
  Subscriber(std::string endpoint, std::string stream, Keys keys = {})
      : endpoint_(std::move(endpoint)),
        stream_(std::move(stream)),
        keys_(std::move(keys)),
        context_(zmq_ctx_new(), zmq_ctx_term) {
    connect();
  }

  // The next pose; nullopt when none comes within that time.
  std::optional<Pose> next(std::chrono::milliseconds within) {
    const auto end = std::chrono::steady_clock::now() + within;
    while (true) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          end - std::chrono::steady_clock::now());
      zmq_pollitem_t item{socket_.get(), 0, ZMQ_POLLIN, 0};
      if (left.count() < 0) return {};
      const auto wait = std::min(left, kSilence);
      const int ready = zmq_poll(&item, 1, static_cast<long>(wait.count()));
      if (ready < 0) continue;  // a signal came, and nobody knows after how long
      if (ready == 0) {
        silent_ += wait;
        // libzmq gives up when somebody else had the daemon's port meanwhile.
        if (silent_ >= kSilence) connect();
        continue;
      }
      bool more = false;
      const std::string topic = part(more);
      const std::string body = more ? part(more) : std::string();
      while (more) part(more);
      // A subscription is a prefix: "walker" also brings "walker-raw".
      if (topic == "skeleton/" + stream_) {
        auto skeleton = std::make_shared<posed::v1::Skeleton>();
        if (!skeleton->ParseFromString(body) || !is_whole(*skeleton)) continue;
        skeleton_ = skeleton;
        silent_ = {};
      } else if (topic == "pose/" + stream_ && skeleton_ != nullptr) {
        Pose pose{{}, skeleton_};
        if (pose.frame.ParseFromString(body) && fits(pose)) return pose;
      }
    }
  }

 private:
  // Skeletons come every second, whatever the stream does.
  static constexpr std::chrono::milliseconds kSilence{5000};
  static constexpr std::int64_t kMaxReceivedPart = 1 << 20;  // bytes; a daemon sends no longer one

  void connect() {
    silent_ = {};
    socket_ = {zmq_socket(context_.get(), ZMQ_SUB), zmq_close};
    if (!socket_) throw std::runtime_error("no ZeroMQ socket: raise the limit of open files");
    zmq_setsockopt(socket_.get(), ZMQ_MAXMSGSIZE, &kMaxReceivedPart, sizeof kMaxReceivedPart);
    set(ZMQ_RCVHWM, 16);  // newest data wins: keep no old poses
    set(ZMQ_LINGER, 0);
    // A daemon that loses its power or its network says nothing: TCP finds that out in five
    // seconds.
    set(ZMQ_TCP_KEEPALIVE, 1);
    set(ZMQ_TCP_KEEPALIVE_IDLE, 2);
    set(ZMQ_TCP_KEEPALIVE_INTVL, 1);
    set(ZMQ_TCP_KEEPALIVE_CNT, 3);
    if (!keys_.own_secret_file.empty()) use(keys_);
    for (const char* topic : {"pose/", "skeleton/"}) {
      const std::string whole = topic + stream_;
      zmq_setsockopt(socket_.get(), ZMQ_SUBSCRIBE, whole.data(), whole.size());
    }
    if (zmq_connect(socket_.get(), endpoint_.c_str()) != 0) {
      throw std::runtime_error(endpoint_ + ": " + zmq_strerror(zmq_errno()) +
                               "; an endpoint looks like tcp://127.0.0.1:5570");
    }
  }

  static bool is_whole(const posed::v1::Skeleton& skeleton) {
    const int joints = skeleton.parent_size();
    if (joints == 0 || skeleton.offset_m_size() != 3 * joints ||
        skeleton.joint_name_size() != joints) {
      return false;
    }
    for (int j = 0; j < joints; ++j) {
      if (skeleton.parent(j) < -1 || skeleton.parent(j) >= j) return false;
    }
    return skeleton.root_joint() < static_cast<std::uint32_t>(joints);
  }
  static bool fits(const Pose& pose) {
    return pose.frame.skeleton_id() == pose.skeleton->id() &&
           pose.frame.root_position_m_size() == 3 &&
           pose.frame.rotation_xyzw_size() == 4 * pose.skeleton->parent_size();
  }

  static std::string read_key(const std::string& path) {
    std::string key;
    if (!(std::ifstream(path) >> key) || key.size() != 40) {
      throw std::runtime_error(path + ": this is no key that `posed keygen` wrote");
    }
    return key;
  }

  void use(const Keys& keys) {
    const std::string secret = read_key(keys.own_secret_file);
    const std::string server = read_key(keys.server_public_file);
    std::array<char, 41> own{};
    if (zmq_curve_public(own.data(), secret.c_str()) != 0) {
      throw std::runtime_error("this libzmq cannot use keys: it was built without CURVE");
    }
    zmq_setsockopt(socket_.get(), ZMQ_CURVE_SECRETKEY, secret.c_str(), secret.size());
    zmq_setsockopt(socket_.get(), ZMQ_CURVE_PUBLICKEY, own.data(), own.size() - 1);
    zmq_setsockopt(socket_.get(), ZMQ_CURVE_SERVERKEY, server.c_str(), server.size());
  }

  void set(int option, int value) { zmq_setsockopt(socket_.get(), option, &value, sizeof value); }

  // The next part of a message, of which the socket has all or nothing.
  std::string part(bool& more) {
    zmq_msg_t message;
    zmq_msg_init(&message);
    std::string bytes;
    if (zmq_msg_recv(&message, socket_.get(), 0) >= 0) {
      bytes.assign(static_cast<const char*>(zmq_msg_data(&message)), zmq_msg_size(&message));
    }
    more = zmq_msg_more(&message) != 0;
    zmq_msg_close(&message);
    return bytes;
  }

  std::string endpoint_, stream_;
  Keys keys_;
  std::chrono::milliseconds silent_{};  // waited in vain since the last skeleton
  std::unique_ptr<void, int (*)(void*)> context_;
  std::unique_ptr<void, int (*)(void*)> socket_{nullptr, zmq_close};
  std::shared_ptr<const posed::v1::Skeleton> skeleton_;
};

}  // namespace posed_client
