#include "drivers/axis/emulator.hpp"

#include <algorithm>

#include "drivers/axis/decoder.hpp"
#include "drivers/emulate/motion.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::axis {
namespace {

constexpr float kSmaller = 0.9F;  // the waver

}  // namespace

AxisEmulator::AxisEmulator(const EmulatorSettings& settings)
    : settings_(settings), people_(2), frames_(nanoseconds(1.0 / settings.rate_hz)) {
  for (std::size_t body = 0; body < people_.size(); ++body) {
    Person& person = people_[body];
    person.entry.avatar =
        make_avatar(static_cast<std::uint32_t>(body), body == 0 ? "Walker" : "Waver");
    person.entry.reference = settings.content.reference;
    person.entry.measured = settings.content.displacement;
    person.entry.figure = settings.figure;
    person.message.avatar = person.entry.avatar;
    person.message.content = settings.content;
    person.rotation_xyzw.fill(kIdentity);
    set_scale(body, body == 0 ? 1.0F : kSmaller);
    // Without displacement the host assumes its own proportions.
    const AvatarEntry as_sent =
        person.entry.measured
            ? person.entry
            : AvatarEntry{.avatar = person.entry.avatar,
                          .reference = person.entry.reference,
                          .figure = settings.figure,
                          .offset_cm = default_proportions(figure_of(person.entry))};
    person.skeleton = skeleton_of(as_sent, settings.order).value();
  }
  frames_.start(0);
}

void AxisEmulator::set_scale(std::size_t body, float scale) {
  Person& person = people_[body];
  person.entry.offset_cm = default_proportions(settings_.figure.value_or(Figure::kPro));
  for (Vec3f& offset : person.entry.offset_cm) {
    for (float& x_cm : offset) x_cm *= scale;
  }
  person.root_m[1] = person.entry.offset_cm[kHips][1] * static_cast<float>(kCentimetre_m);
}

const Skeleton* AxisEmulator::skeleton(std::size_t body) const {
  return body < people_.size() ? people_[body].skeleton.get() : nullptr;
}

// The format has no place for a joint that is not known: it stays as it was.
void AxisEmulator::pose(std::size_t body, const Frame& frame) {
  if (body >= people_.size()) return;
  Person& person = people_[body];
  person.posed = true;
  person.root_m = frame.root_position_m;
  const std::size_t joints =
      std::min<std::size_t>(person.skeleton->joints.size(), frame.joint_count);
  for (std::size_t j = 0; j < joints; ++j) {
    if (frame.valid[j]) person.rotation_xyzw[j] = frame.rotation_xyzw[j];
  }
}

void AxisEmulator::move(double time_s) {
  for (std::size_t body = 0; body < people_.size(); ++body) {
    Person& person = people_[body];
    if (person.posed) continue;
    const auto turn = [&](Bone bone, const Eigen::Quaterniond& rotation) {
      person.rotation_xyzw[person.skeleton->joint_of(bone)] = from_eigen(rotation);
    };
    const float hips_m = person.root_m[1];
    person.root_m =
        body == 0 ? emulate::walk(time_s, hips_m, turn) : emulate::wave(time_s, hips_m, turn);
  }
}

void AxisEmulator::encode(const Person& person, Bytes& out) const {
  const std::size_t before = out.size();
  out.resize(before + kMaxText);
  const std::span room = std::span(out).subspan(before);
  std::size_t size = 0;
  if (settings_.form == Form::kText) {
    size = encode_text(person.message, {reinterpret_cast<char*>(room.data()), room.size() - 1});
    room[size++] = std::byte{'\n'};
  } else {
    size = encode_binary(person.message, settings_.form, room);
  }
  out.resize(before + size);
}

void AxisEmulator::emit(std::int64_t now_ns, Bytes& out) {
  if (piece_.empty()) {
    move(seconds(frames_.due_ns()));
    ++number_;
    waiting_.clear();
    for (Person& person : people_) {
      if (!person.present) continue;
      const std::size_t before = waiting_.size();
      person.message.frame_number = number_;
      fill_values(*person.skeleton, person.entry.offset_cm, person.rotation_xyzw, person.root_m,
                  person.last, person.message);
      encode(person, waiting_);
      for (std::size_t left = waiting_.size() - before; settings_.split_bytes != 0 && left != 0;) {
        piece_.push_back(std::min(left, settings_.split_bytes));
        left -= piece_.back();
      }
    }
    if (settings_.split_bytes == 0) piece_.push_back(waiting_.size());
    std::ranges::reverse(piece_);
  }
  if (!piece_.empty()) {
    const auto end = waiting_.begin() + static_cast<std::ptrdiff_t>(piece_.back());
    out.insert(out.end(), waiting_.begin(), end);
    waiting_.erase(waiting_.begin(), end);
    piece_.pop_back();
  }
  if (piece_.empty()) frames_.step(now_ns);
}

}  // namespace posed::drivers::axis
