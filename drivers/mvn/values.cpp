#include "drivers/mvn/values.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <string_view>

#include "drivers/mvn/axes.hpp"
#include "drivers/pose_values.hpp"
#include "proto/frame/degree.hpp"

namespace posed::drivers::mvn {
namespace {

enum class QuantityKind : std::uint8_t { kPosition, kVector, kAngles, kRotation };

struct Quantity {
  std::string_view name;
  std::string_view unit;
  QuantityKind kind = QuantityKind::kVector;
};

constexpr std::size_t numbers_of(const Quantity& quantity) noexcept {
  return quantity.kind == QuantityKind::kRotation ? 4 : 3;
}

constexpr std::array kMassQuantities{Quantity{"centre_of_mass", "m", QuantityKind::kPosition}};
constexpr std::array kAngleQuantities{Quantity{"angle", "rad", QuantityKind::kAngles}};
constexpr std::array kLinearQuantities{Quantity{"position", "m", QuantityKind::kPosition},
                                       Quantity{"velocity", "m/s"},
                                       Quantity{"acceleration", "m/s^2"}};
constexpr std::array kAngularQuantities{Quantity{"rotation", "1", QuantityKind::kRotation},
                                        Quantity{"angular_velocity", "rad/s"},
                                        Quantity{"angular_acceleration", "rad/s^2"}};
constexpr Quantity kTrackerRotation{"tracker_rotation", "1", QuantityKind::kRotation};
constexpr Quantity kFreeAcceleration{"tracker_free_acceleration", "m/s^2"};
constexpr Quantity kMagneticField{"tracker_magnetic_field", "1"};
constexpr std::array kTrackerQuantities{kTrackerRotation, kFreeAcceleration, kMagneticField};
constexpr std::array kLongTrackerQuantities{
    kTrackerRotation, kFreeAcceleration, Quantity{"tracker_acceleration", "m/s^2"},
    Quantity{"tracker_angular_velocity", "rad/s"}, kMagneticField};

// The segments that a group has values of, and which ones.
struct GroupTable {
  std::size_t first = 0;
  std::size_t segments = 0;  // 0: the values are of the whole person
  std::span<const Quantity> quantities;
};
constexpr std::array<GroupTable, kValueGroups> kGroups{{
    {0, 0, kMassQuantities},
    {1, kBodySegments - 1, kAngleQuantities},  // the joint above a segment; the pelvis has none
    {0, kBodySegments, kLinearQuantities},
    {0, kBodySegments, kAngularQuantities},
    {0, kBodySegments, kTrackerQuantities},
    {0, kBodySegments, kLongTrackerQuantities},
}};

constexpr const GroupTable& table_of(ValueGroup group) noexcept {
  return kGroups[static_cast<std::size_t>(group)];
}

constexpr std::size_t item_values(const GroupTable& table) noexcept {
  std::size_t count = 0;
  for (const Quantity& quantity : table.quantities) count += numbers_of(quantity);
  return count;
}

constexpr std::size_t kNotOurs = kBodySegments;  // a prop, a finger, angles between other segments
constexpr std::int32_t kMaxSegmentId = static_cast<std::int32_t>(kMaxItems) + 1;

// The segment that an item of types 21 to 23 names. False: no character has it.
RT_SAFE bool read_segment_id(BigEndianReader& reader, std::size_t& segment) noexcept {
  const std::int32_t id = reader.i32();
  if (id < 1 || id > kMaxSegmentId) return false;
  segment = std::min(static_cast<std::size_t>(id - 1), kNotOurs);
  return true;
}

// The lower segment of the joint that an item of type 20 names. MVN also streams angles between
// segments that are no neighbours, or from the vertical (segment 0): they are no joints.
RT_SAFE bool read_joint_id(BigEndianReader& reader, std::size_t& segment) noexcept {
  const std::int32_t parent = reader.i32();
  const std::int32_t child = reader.i32();
  if (parent < 0 || child < kPointsOfSegment) return false;
  const std::int32_t parent_id = parent / kPointsOfSegment;
  const std::int32_t child_id = child / kPointsOfSegment;
  if (parent_id > kMaxSegmentId || child_id > kMaxSegmentId) return false;
  segment = std::min(static_cast<std::size_t>(child_id - 1), kNotOurs);
  if (segment == 0 || parent_segment(segment) != parent_id - 1) segment = kNotOurs;
  return true;
}

bool is_finite(const Vec3f& v) noexcept {
  return std::ranges::all_of(v, [](float x) { return std::isfinite(x); });
}

// Reads a quantity to `to`. False: it is none.
RT_SAFE bool read_quantity(QuantityKind kind, BigEndianReader& reader, std::span<float> to,
                           bool& seen) noexcept {
  seen = true;
  if (kind == QuantityKind::kRotation) {
    Quatf rotation_xyzw = read_quaternion(reader);
    const bool valid = accept_rotation(rotation_xyzw, seen);
    std::ranges::copy(rotation_xyzw, to.begin());
    return valid;
  }
  Vec3f v = from_z_up(read_vector(reader));
  bool valid = is_finite(v);
  if (kind == QuantityKind::kPosition) valid = is_plausible(v);
  if (kind == QuantityKind::kAngles) {
    for (float& x : v) {
      const double angle_rad = static_cast<double>(x) * kDegree;
      valid = valid && std::abs(angle_rad) <= kMaxAngle_rad;
      x = static_cast<float>(angle_rad);
    }
  }
  std::ranges::copy(v, to.begin());
  return valid;
}

// Reads the numbers of one item to the values from `begin` on. False: a number is wrong.
RT_SAFE bool read_item(const GroupTable& table, BigEndianReader& reader, std::size_t begin,
                       GroupValues& values) noexcept {
  bool valid = true;
  for (const Quantity& quantity : table.quantities) {
    const std::size_t count = numbers_of(quantity);
    bool seen = false;
    const auto to = std::span(values.value).subspan(begin, count);
    valid = read_quantity(quantity.kind, reader, to, seen) && valid;
    for (std::size_t i = 0; i < count; ++i) values.valid[begin + i] = seen;
    begin += count;
  }
  return valid;
}

ValueGroup group_of(const Datagram& datagram) noexcept {
  switch (datagram.head.type) {
    case Type::kCentreOfMass:
      return ValueGroup::kCentreOfMass;
    case Type::kJointAngles:
      return ValueGroup::kJointAngles;
    case Type::kLinear:
      return ValueGroup::kLinear;
    case Type::kAngular:
      return ValueGroup::kAngular;
    default:
      break;
  }
  const bool brief = datagram.payload.size() == datagram.head.items * item_bytes(Type::kTrackers);
  return brief ? ValueGroup::kTrackers : ValueGroup::kLongTrackers;
}

}  // namespace

Outcome decode_values(const Datagram& datagram, GroupValues& values) noexcept {
  values.group = group_of(datagram);
  values.valid.reset();
  const GroupTable& table = table_of(values.group);
  BigEndianReader reader(datagram.payload);
  if (table.segments == 0) {
    return read_item(table, reader, 0, values) ? Outcome::kOk : Outcome::kOutOfRange;
  }
  const std::size_t width = item_values(table);
  const bool joints = values.group == ValueGroup::kJointAngles;
  std::bitset<kBodySegments> came;
  bool valid = true;
  for (std::size_t i = 0; i < datagram.head.items; ++i) {
    std::size_t segment = kNotOurs;
    if (!(joints ? read_joint_id(reader, segment) : read_segment_id(reader, segment))) {
      return Outcome::kOutOfRange;
    }
    if (segment == kNotOurs) {
      static_cast<void>(reader.bytes(width * sizeof(float)));
      continue;
    }
    valid = valid && !came[segment];
    came.set(segment);
    valid = read_item(table, reader, (segment - table.first) * width, values) && valid;
  }
  return valid ? Outcome::kOk : Outcome::kOutOfRange;
}

std::size_t value_count(ValueGroup group) noexcept {
  const GroupTable& table = table_of(group);
  return std::max<std::size_t>(table.segments, 1) * item_values(table);
}

ValuePlaces place_values(ValueGroups groups) noexcept {
  ValuePlaces places;
  for (std::size_t i = 0; i < kValueGroups; ++i) {
    const std::size_t count = value_count(static_cast<ValueGroup>(i));
    const bool fits = groups[i] && places.count + count <= std::size_t{kMaxSampleValues};
    places.begin[i] = fits ? places.count : ValuePlaces::kNone;
    if (fits) places.count += count;
  }
  return places;
}

SampleLayout name_values(ValueGroups groups) {
  constexpr std::string_view kAxes = "xyzw";
  const ValuePlaces places = place_values(groups);
  SampleLayout layout;
  for (std::size_t i = 0; i < kValueGroups; ++i) {
    if (places.begin[i] == ValuePlaces::kNone) continue;
    const GroupTable& table = kGroups[i];
    for (std::size_t s = 0; s < std::max<std::size_t>(table.segments, 1); ++s) {
      const std::string whose = table.segments == 0 ? "" : segment_name(table.first + s) + '_';
      for (const Quantity& quantity : table.quantities) {
        for (const char axis : kAxes.substr(0, numbers_of(quantity))) {
          layout.names.push_back(whose + std::string(quantity.name) + '_' + axis);
          layout.units.emplace_back(quantity.unit);
        }
      }
    }
  }
  return layout;
}

}  // namespace posed::drivers::mvn
