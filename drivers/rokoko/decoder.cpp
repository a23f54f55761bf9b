#include "drivers/rokoko/decoder.hpp"

#include "drivers/rokoko/lz4_frame.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::rokoko {
namespace {

// Sets the rotations relative to the parents. A joint that this frame does not have is not valid:
// it turns with its parent. RT-safe.
void set_rotations(const BodyPlan& plan, const Skeleton& skeleton, const SeenBody& body,
                   Frame& frame) noexcept {
  std::array<Quatf, kMaxJoints> global{};
  for (std::size_t j = 0; j < plan.joint.size(); ++j) {
    const int parent = skeleton.joints[j].parent;
    const Quatf& around = parent < 0 ? kIdentity : global[static_cast<std::size_t>(parent)];
    const bool seen = body.joints[plan.joint[j]];
    frame.valid[j] = seen;
    global[j] = seen ? body.subject->rotation_xyzw[plan.joint[j]] : around;
    frame.rotation_xyzw[j] =
        seen ? from_eigen((to_eigen(around).conjugate() * to_eigen(global[j])).normalized())
             : kIdentity;
  }
}

}  // namespace

// RT-safe.
void StudioDecoder::feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
                         Sink& sink) noexcept {
  Outcome outcome = read(bytes);
  if (outcome == Outcome::kOk) outcome = clock_.accept(frame_.timestamp_s);
  const std::int64_t active_ns = active_time_.to(arrival_ns);
  if (outcome == Outcome::kOk) outcome = accept_frame(active_ns, sink);
  sink.outcome(outcome);
}

// RT-safe.
Outcome StudioDecoder::read(std::span<const std::byte> bytes) noexcept {
  if (is_lz4_frame(bytes)) {
    const Outcome outcome = decode_lz4_frame(bytes, json_, bytes);
    if (outcome != Outcome::kOk) return outcome;
  }
  const std::string_view json(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return read_studio_frame(json, frame_);
}

// RT-safe.
Outcome StudioDecoder::accept_frame(std::int64_t active_ns, Sink& sink) noexcept {
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
  if (layout_ == nullptr) return Outcome::kForeign;
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

// RT-safe.
Outcome StudioDecoder::emit(const SeenBody& seen, Sink& sink) noexcept {
  const std::size_t body = layout_->body_of(seen.key);
  if (body == layout_->bodies.size()) return Outcome::kForeign;  // described, not yet in use
  if (taken_[body]) return Outcome::kOutOfRange;
  taken_.set(body);
  const BodyPlan& plan = layout_->plans[body];
  const Subject& subject = *seen.subject;
  if (plan.face && subject.face_seen.any()) emit_face(body, subject, sink);
  if (plan.joint.empty()) return Outcome::kOk;
  // Without the root nothing says where the body is.
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

// RT-safe.
void StudioDecoder::emit_face(std::size_t body, const Subject& subject, Sink& sink) noexcept {
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
