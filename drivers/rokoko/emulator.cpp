#include "drivers/rokoko/emulator.hpp"

#include <algorithm>
#include <utility>

#include "drivers/emulate/motion.hpp"
#include "drivers/rokoko/decoder.hpp"
#include "drivers/rokoko/encode.hpp"
#include "proto/clip/text.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::rokoko {

namespace {

constexpr std::size_t kAnna = 0, kBen = 1, kSword = 2;
constexpr double kHipHeight_m = 0.96;
constexpr std::array<std::string_view, 3> kVersionNumbers{"2", "3", "3"};

DescribedBody emulated_sword() {
  DescribedBody body;
  body.key.part = Part::kProp;
  body.key.name.keep("Sword");
  body.joints.set(0);
  return body;
}

std::string quoted_name(const DescribedBody& body) {
  return '"' + std::string(body.key.name.text()) + '"';
}

}  // namespace

StudioEmulator::StudioEmulator(const StudioEmulatorSettings& settings)
    : settings_(settings), pace_(nanoseconds(1.0 / settings.rate_hz)) {
  bodies_[kAnna].described = average_person("Anna", JointSet().set(), 1.0F);
  bodies_[kBen].described = average_person("Ben", without_fingers(), 1.0F);
  bodies_[kSword].described = emulated_sword();
  for (EmulatedBody& body : bodies_) {
    body.skeleton =
        skeleton_of(body.described, std::string(body.described.key.name.text())).value();
    const auto& joints = body.skeleton->joints;
    body.frame.joint_count = static_cast<std::uint16_t>(joints.size());
    body.frame.valid.set();
    for (std::size_t j = 0; j < joints.size(); ++j) {
      body.frame.rotation_xyzw[j] = from_eigen(local_from_canonical(*body.skeleton, j));
    }
  }
  pace_.start(0);
}

const Skeleton* StudioEmulator::skeleton(std::size_t body) const {
  return body < bodies_.size() && bodies_[body].present ? bodies_[body].skeleton.get() : nullptr;
}

void StudioEmulator::pose(std::size_t body, const Frame& frame) {
  if (body >= bodies_.size()) return;
  EmulatedBody& posed = bodies_[body];
  posed.posed = true;
  posed.frame = frame;
  posed.frame.joint_count = static_cast<std::uint16_t>(posed.skeleton->joints.size());
  for (std::size_t j = frame.joint_count; j < posed.frame.joint_count; ++j) {
    posed.frame.valid[j] = false;
  }
}

// Turns a joint away from T-pose by a rotation in the axes of the canonical humanoid.
void StudioEmulator::turn(std::size_t body, Bone bone, const Eigen::Quaterniond& canonical) {
  const Skeleton& skeleton = *bodies_[body].skeleton;
  const int j = skeleton.joint_of(bone);
  bodies_[body].frame.rotation_xyzw[j] = from_eigen(local_from_canonical(skeleton, j, canonical));
}

void StudioEmulator::move(double time_s) {
  const double swing = emulate::swing_rad(time_s, 0.5);
  const auto hips_m = static_cast<float>(kHipHeight_m);
  const auto turner = [this](std::size_t body) {
    return [this, body](Bone bone, const Eigen::Quaterniond& canonical) {
      turn(body, bone, canonical);
    };
  };
  if (!bodies_[kAnna].posed) {
    bodies_[kAnna].frame.root_position_m = emulate::walk(time_s, hips_m, turner(kAnna));
    for (const auto& [left, right] :
         {std::pair{Bone::kLeftIndexProximal, Bone::kRightIndexProximal},
          {Bone::kLeftMiddleProximal, Bone::kRightMiddleProximal},
          {Bone::kLeftRingProximal, Bone::kRightRingProximal},
          {Bone::kLeftLittleProximal, Bone::kRightLittleProximal}}) {
      turn(kAnna, left, axis_rotation(Axis::kZ, -0.5 - swing));
      turn(kAnna, right, axis_rotation(Axis::kZ, 0.5 + swing));
    }
    jaw_ = 50.0 + 100.0 * swing;
  }
  if (!bodies_[kBen].posed) {
    bodies_[kBen].frame.root_position_m = emulate::wave(time_s, hips_m, turner(kBen), 0.5);
  }
  if (!bodies_[kSword].posed) {
    bodies_[kSword].frame.root_position_m = {0.8F, static_cast<float>(1.0 + swing), 2.5F};
    bodies_[kSword].frame.rotation_xyzw[0] = from_eigen(axis_rotation(Axis::kX, swing));
  }
}

void StudioEmulator::emit(std::int64_t now_ns, Bytes& out) {
  const std::int64_t time_ns = pace_.due_ns();
  pace_.step(now_ns);
  move(seconds(time_ns));
  const std::string json = frame_json(seconds(time_ns - began_ns_));
  const auto bytes = settings_.lz4 ? lz4_writer_.compress(json) : std::as_bytes(std::span(json));
  out.insert(out.end(), bytes.begin(), bytes.end());
}

std::string StudioEmulator::frame_json(double time_s) const {
  std::string actors, props;
  for (const EmulatedBody& body : bodies_) {
    if (!body.present) continue;
    if (body.described.key.part == Part::kProp) {
      props += "{\"name\":" + quoted_name(body.described) + ",\"color\":[128,128,128],\"type\":0,";
      append_transform(props, body.frame.root_position_m, body.frame.rotation_xyzw[0]);
      props += '}';
    } else {
      actors += (actors.empty() ? "" : ",") + actor_json(body);
    }
  }
  std::string json =
      "{\"version\":" + std::string(kVersionNumbers[static_cast<std::size_t>(settings_.version)]);
  const std::string content = "\"timestamp\":" + clip::number_text(time_s) + ",\"actors\":[" +
                              actors + "],\"props\":[" + props + "]";
  if (settings_.version == StudioVersion::k3) {
    return json + ",\"fps\":" + clip::number_text(settings_.rate_hz) + ",\"scene\":{" + content +
           "}}";
  }
  json += "," + content + ",\"trackers\":[],\"faces\":[";
  if (bodies_[kAnna].present) json += face_json();
  return json + "]}";
}

std::string StudioEmulator::actor_json(const EmulatedBody& body) const {
  const std::string name = quoted_name(body.described);
  const bool anna = &body == &bodies_[kAnna];
  const std::string head = "{\"name\":" + name + ",\"color\":[50,100,200],";
  if (settings_.version != StudioVersion::k3) {
    return head + "\"profileName\":" + name + "," + joints_json(body) + '}';
  }
  const std::string gloves = anna ? "true" : "false";
  const std::string has_body = anna && gloves_only_ ? "false" : "true";
  return head + "\"meta\":{\"hasGloves\":" + gloves + ",\"hasLeftGlove\":" + gloves +
         ",\"hasRightGlove\":" + gloves + ",\"hasBody\":" + has_body + ",\"hasFace\":" + gloves +
         "},\"dimensions\":{\"totalHeight\":1.75,\"hipHeight\":" + clip::number_text(kHipHeight_m) +
         "},\"body\":{" + joints_json(body) + "}" + (anna ? ",\"face\":" + face_json() : "") + '}';
}

std::string StudioEmulator::joints_json(const EmulatedBody& body) const {
  std::string json;
  append_joints(json, *body.skeleton, body.frame);
  return json;
}

std::string StudioEmulator::face_json() const {
  const std::string name = quoted_name(bodies_[kAnna].described);
  std::string json = "{\"faceId\":" + name + ",\"profileName\":" + name;
  for (std::size_t i = 0; i < kFaceValues; ++i) {
    const std::string_view value = face_value_name(i);
    json += ",\"" + std::string(value) + "\":";
    json +=
        value == "jawOpen" ? clip::number_text(static_cast<double>(static_cast<float>(jaw_))) : "0";
  }
  return json + '}';
}

}  // namespace posed::drivers::rokoko
