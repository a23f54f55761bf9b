#include "drivers/mvn/tracked.hpp"

#include <algorithm>
#include <cmath>

#include "proto/frame/rotation.hpp"

namespace posed::drivers::mvn {
namespace {

constexpr std::int64_t kLookEvery_ns = kNanosPerSecond;
// MVN's joints give way by a few millimetres while somebody moves, and its lowest spine segment
// lies up to 13 mm elsewhere than in T-pose. Less than this is no other figure.
constexpr double kOtherFigure_m = 0.02;

// 02 is what MVN computes with; 05 leaves out the fingers; the angles of 01 are rounded most.
int rank(Type type) noexcept {
  switch (type) {
    case Type::kQuaternion:
      return 2;
    case Type::kUnity:
      return 1;
    default:
      return 0;
  }
}

// Each of the segments from `from` on and below `to` from its parent, in the parent's frame. False:
// a segment that is needed was not seen.
RT_SAFE bool offsets_of(const CharacterPose& pose, std::size_t from, std::size_t to,
                        std::array<Vec3f, kSegments>& offset_m) noexcept {
  for (std::size_t i = from; i < to; ++i) {
    const SegmentPose& segment = pose.segments[i];
    const int parent = parent_segment(i);
    if (!segment.seen) return false;
    if (parent < 0) continue;
    const SegmentPose& above = pose.segments[parent];
    if (!above.seen) return false;
    offset_m[i] = segment.position_m;
    if (pose.local) continue;
    Eigen::Vector3d apart_m;
    for (std::size_t k = 0; k < 3; ++k) {
      apart_m[static_cast<int>(k)] =
          static_cast<double>(segment.position_m[k]) - static_cast<double>(above.position_m[k]);
    }
    const Eigen::Vector3d turned_m = to_eigen_double(above.rotation_xyzw).conjugate() * apart_m;
    for (std::size_t k = 0; k < 3; ++k) {
      offset_m[i][k] = static_cast<float>(turned_m[static_cast<int>(k)]);
    }
  }
  return true;
}

// How high the pelvis stands above the toes of a straight leg.
RT_SAFE float pelvis_height_m(const std::array<Vec3f, kSegments>& offset_m) noexcept {
  constexpr std::array<std::size_t, 4> kLeftLeg{19, 20, 21, 22};
  float height_m = 0.0F;
  for (const std::size_t i : kLeftLeg) height_m -= offset_m[i][1];
  return height_m;
}

}  // namespace

void Tracked::begin(std::uint8_t id, std::int64_t now_ns) noexcept {
  *this = Tracked();
  known = true;
  first_ns = received_ns = now_ns;
  character.id = id;
}

bool Tracked::prefers(const Head& head, std::int64_t now_ns) noexcept {
  const bool other = posed_ && head.type != type_;
  if (other && rank(head.type) < rank(type_) && now_ns - type_ns_ < kPatience_ns) return false;
  if (other || !posed_) {
    other_done_ = posed_;
    assembly_.close();
  }
  posed_ = true;
  type_ = head.type;
  type_ns_ = now_ns;
  if (other_done_ && head.sample == done_) return false;
  other_done_ = false;
  return true;
}

Tracked::Part Tracked::accept_part(const Datagram& datagram, Assembly::Buffer& to) noexcept {
  const Head& head = datagram.head;
  Part part;
  if (!assembly_.is_open() || head.sample != assembly_.sample()) {
    part.outcome = order_.accept(head.sample);
    if (part.outcome != Outcome::kOk) return part;
    part.lost = assembly_.is_open();
    assembly_.close();
    done_ = head.sample;
    if (head.part == 0 && head.last) {
      part.whole = true;
      part.items = datagram.payload;
      return part;
    }
    assembly_.begin(head.sample);
  }
  part.outcome = assembly_.add(datagram);
  part.whole = part.outcome == Outcome::kOk && assembly_.is_whole();
  if (part.whole) {
    assembly_.close();
    part.items = assembly_.gather(to);
  }
  return part;
}

void Tracked::set_name(std::string_view name) noexcept {
  while (!name.empty() && (name.back() == ' ' || name.back() == '\r')) name.remove_suffix(1);
  while (!name.empty() && name.front() == ' ') name.remove_prefix(1);
  name = name.substr(0, kMvnNameBytes);
  named_ = true;
  if (name == std::string_view(character.name.data(), character.name_bytes)) return;
  std::ranges::copy(name, character.name.begin());
  character.name_bytes = static_cast<std::uint8_t>(name.size());
  changed = true;
}

void Tracked::accept_offsets(const Offsets& offset_m, std::size_t from, std::size_t to) noexcept {
  for (std::size_t i = from; i < to; ++i) character.offset_m[i] = offset_m[i];
  changed = true;
}

double Tracked::farthest_m(const Offsets& offset_m, std::size_t from,
                           std::size_t to) const noexcept {
  double farthest_m = 0.0;
  for (std::size_t i = std::max<std::size_t>(from, 1); i < to; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double apart_m =
          static_cast<double>(offset_m[i][k]) - static_cast<double>(character.offset_m[i][k]);
      farthest_m = std::max(farthest_m, std::abs(apart_m));
    }
  }
  return farthest_m;
}

void Tracked::set_scale(const std::array<Vec3f, kBodySegments>& position_m) noexcept {
  Offsets offset_m{};
  offset_m[0] = {0.0F, position_m[0][1], 0.0F};
  for (std::size_t i = 1; i < kBodySegments; ++i) {
    const Vec3f& above = position_m[parent_segment(i)];
    for (std::size_t k = 0; k < 3; ++k) offset_m[i][k] = position_m[i][k] - above[k];
  }
  scaled_ = true;
  const bool takes =
      !described || !has_body_ || farthest_m(offset_m, 0, kBodySegments) > kOtherFigure_m;
  has_body_ = true;
  if (takes) accept_offsets(offset_m, 0, kBodySegments);
}

void Tracked::look_at(const CharacterPose& pose, std::int64_t now_ns) noexcept {
  looked_ = true;
  const bool new_fingers = pose.fingers && !character.fingers;
  const bool look = now_ns - look_ns_ >= kLookEvery_ns;
  if (has_body_ && !new_fingers && !look) return;
  Offsets offset_m{};
  const bool body = offsets_of(pose, 0, kBodySegments, offset_m);
  const bool hands = pose.fingers && offsets_of(pose, kBodySegments, kSegments, offset_m);
  if (body) offset_m[0] = {0.0F, pelvis_height_m(offset_m), 0.0F};
  if (body && !has_body_) {
    accept_offsets(offset_m, 0, kBodySegments);
    has_body_ = true;
  }
  if (hands && new_fingers) {
    accept_offsets(offset_m, kBodySegments, kSegments);
    character.fingers = true;
  }
  if (!look) return;
  look_ns_ = now_ns;
  // Two looks in a row must agree that the figure is another one.
  const std::size_t from = body && !scaled_ ? 0 : kBodySegments;
  const std::size_t to = hands ? kSegments : kBodySegments;
  const bool differs = farthest_m(offset_m, from, to) > kOtherFigure_m;
  if (differs && differs_) accept_offsets(offset_m, from, to);
  differs_ = differs && !differs_;
}

bool Tracked::belongs(std::int64_t now_ns) const noexcept {
  if (!has_body_ || !looked_ || now_ns - received_ns >= kPatience_ns) return false;
  return described || (named_ && scaled_) || now_ns - first_ns >= kPatience_ns;
}

}  // namespace posed::drivers::mvn
