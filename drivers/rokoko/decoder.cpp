#include "drivers/rokoko/decoder.hpp"

#include <algorithm>
#include <utility>

#include "drivers/rokoko/lz4_frame.hpp"
#include "proto/frame/rotation.hpp"
#include "proto/text/clean.hpp"

namespace posed::drivers::rokoko {

namespace {

// The body's own name; Studio lets two props, or a prop and an actor, have the same.
std::string body_name(const BodyKey& key, const std::vector<Body>& before) {
  std::string name = key.name.empty() ? "unnamed" : clean(key.name.text());
  if (key.part == Part::kLeftHand) name += " left hand";
  if (key.part == Part::kRightHand) name += " right hand";
  const auto is_used = [&before](const std::string& wanted) {
    return std::ranges::find(before, wanted, &Body::name) != before.end();
  };
  if (!is_used(name)) return name;
  for (int number = 2;; ++number) {
    const std::string numbered = name + ' ' + std::to_string(number);
    if (!is_used(numbered)) return numbered;
  }
}

SampleLayout face_samples() {
  SampleLayout samples;
  for (std::size_t i = 0; i < kFaceValues; ++i) {
    samples.names.emplace_back(face_value_name(i));
    samples.units.emplace_back("1");
  }
  return samples;
}

}  // namespace

Result<std::shared_ptr<const Skeleton>> skeleton_of(const DescribedBody& body,
                                                    const std::string& name) {
  if (body.joints.none()) return nullptr;
  auto skeleton = std::make_shared<Skeleton>();
  skeleton->name = name;
  std::array<int, kStudioJoints> place{};
  for (std::size_t j = 0; j < kStudioJoints; ++j) {
    if (!body.joints[j]) continue;
    place[j] = static_cast<int>(skeleton->joints.size());
    Joint& joint = skeleton->joints.emplace_back();
    if (body.key.part == Part::kProp) {
      joint.name = "prop";
      continue;
    }
    const int parent = parent_among(body.joints, j);
    const Vec3f& offset_m = body.offset_m[j];
    joint.name = studio_joint(j).name;
    joint.parent = parent < 0 ? -1 : place[parent];
    joint.offset_m = {offset_m[0], offset_m[1], offset_m[2]};
    joint.bone = studio_joint(j).bone;
    joint.T_world_joint = to_eigen_double(t_pose_rotation(j));
  }
  TRY(skeleton->finish());
  return skeleton;
}

RT_SAFE std::size_t StudioLayout::body_of(const BodyKey& key) const noexcept {
  return std::ranges::find(plans, key, &BodyPlan::key) - plans.begin();
}

Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description) {
  const auto described = TRY(parse_description(description));
  auto layout = std::make_unique<StudioLayout>();
  for (const DescribedBody& body : described) {
    const std::string name = body_name(body.key, layout->bodies);
    auto skeleton = TRY(skeleton_of(body, name));
    layout->bodies.push_back({.name = name,
                              .skeleton = std::move(skeleton),
                              .samples = body.face ? face_samples() : SampleLayout{}});
    BodyPlan& plan = layout->plans.emplace_back();
    plan.key = body.key;
    plan.face = body.face;
    for (std::size_t j = 0; j < kStudioJoints; ++j) {
      if (body.joints[j]) plan.joint.push_back(static_cast<std::uint8_t>(j));
    }
  }
  return layout;
}

namespace {

// Sets the rotations relative to the parents. A joint that this frame does not have is not valid:
// it turns with its parent.
RT_SAFE void set_rotations(const BodyPlan& plan, const Skeleton& skeleton, const SeenBody& body,
                           Frame& frame) noexcept {
  std::array<Quatf, kMaxJoints> global{};
  for (std::size_t j = 0; j < plan.joint.size(); ++j) {
    const int parent = skeleton.joints[j].parent;
    const Quatf& around = parent < 0 ? kIdentity : global[parent];
    const bool seen = body.joints[plan.joint[j]];
    frame.valid[j] = seen;
    global[j] = seen ? body.subject->rotation_xyzw[plan.joint[j]] : around;
    frame.rotation_xyzw[j] =
        seen ? from_eigen((to_eigen(around).conjugate() * to_eigen(global[j])).normalized())
             : kIdentity;
  }
}

}  // namespace

RT_SAFE void StudioDecoder::feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                                 Sink& sink) noexcept {
  Outcome outcome = read(bytes);
  if (outcome == Outcome::kOk) outcome = clock_.accept(frame_.timestamp_s);
  const std::int64_t active_ns = active_time_.to(arrival_ns);
  if (outcome == Outcome::kOk) outcome = accept_frame(active_ns, sink);
  sink.outcome(outcome);
}

RT_SAFE Outcome StudioDecoder::read(std::span<const std::byte> bytes) noexcept {
  if (is_lz4_frame(bytes)) {
    const Outcome outcome = decode_lz4_frame(bytes, json_, bytes);
    if (outcome != Outcome::kOk) return outcome;
  }
  const std::string_view json(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return read_studio_frame(json, frame_);
}

RT_SAFE Outcome StudioDecoder::accept_frame(std::int64_t active_ns, Sink& sink) noexcept {
  if (frame_.count == 0 && frame_.named_joints) {
    constexpr std::array kDescription{std::byte{kOnlyNamedJoints}};
    if (!std::exchange(told_named_joints_, true)) sink.description(kDescription);
    return Outcome::kOutOfRange;
  }
  Outcome worst = Outcome::kOk;
  std::array<SeenBody, kMaxParts> bodies;
  for (std::size_t i = 0; i < frame_.count; ++i) {
    const Subject& subject = frame_.subjects[i];
    const std::size_t count = subject.valid ? bodies_of(subject, bodies) : 0;
    if (!subject.valid) worst = Outcome::kOutOfRange;
    for (std::size_t k = 0; k < count; ++k) {
      if (!roster_.accept(bodies[k], active_ns)) worst = Outcome::kOutOfRange;
    }
  }
  const auto description = roster_.describe(active_ns);
  if (!description.empty()) sink.description(description);
  if (layout_ == nullptr) return frame_.count == 0 ? worst : Outcome::kForeign;
  taken_.reset();
  for (std::size_t i = 0; i < frame_.count; ++i) {
    const Subject& subject = frame_.subjects[i];
    const std::size_t count = subject.valid ? bodies_of(subject, bodies) : 0;
    for (std::size_t k = 0; k < count; ++k) {
      const Outcome one = emit(bodies[k], sink);
      if (worst == Outcome::kOk) worst = one;
    }
  }
  return worst;
}

RT_SAFE Outcome StudioDecoder::emit(const SeenBody& seen, Sink& sink) noexcept {
  const std::size_t body = layout_->body_of(seen.key);
  if (body == layout_->bodies.size()) return Outcome::kForeign;  // described, not yet in use
  if (taken_[body]) return Outcome::kOutOfRange;
  taken_.set(body);
  const BodyPlan& plan = layout_->plans[body];
  const Subject& subject = *seen.subject;
  if (plan.face && subject.face_seen.any()) emit_face(body, subject, sink);
  if (plan.joint.empty()) return Outcome::kOk;
  // Nothing but the root says where the body is.
  if (!subject.placed[plan.joint[0]]) return Outcome::kOutOfRange;
  const Skeleton& skeleton = *layout_->bodies[body].skeleton;
  Frame frame;
  frame.header.device_ns = clock_.device_ns();
  frame.skeleton = skeleton.id;
  frame.joint_count = static_cast<std::uint16_t>(plan.joint.size());
  frame.root_position_m = subject.position_m[plan.joint[0]];
  set_rotations(plan, skeleton, seen, frame);
  sink.frame(body, frame);
  return Outcome::kOk;
}

RT_SAFE void StudioDecoder::emit_face(std::size_t body, const Subject& subject,
                                      Sink& sink) noexcept {
  Sample sample;
  sample.header.device_ns = clock_.device_ns();
  sample.value_count = kFaceValues;
  for (std::size_t i = 0; i < kFaceValues; ++i) {
    sample.valid[i] = subject.face_seen[i];
    sample.value[i] = subject.face_seen[i] ? subject.face[i] : 0.0F;
  }
  sink.sample(body, sample);
}

}  // namespace posed::drivers::rokoko
