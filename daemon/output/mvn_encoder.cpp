#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/output/datagram_encoder.hpp"
#include "daemon/output/fit.hpp"
#include "drivers/mvn/encode.hpp"
#include "drivers/mvn/figure.hpp"

namespace posed::output {
namespace {

namespace mvn = drivers::mvn;

constexpr std::size_t kMaxDatagram = 1472;  // bytes that Ethernet carries in one piece

// Whether the joints are the segments of a character.
bool is_mvn_character(const Skeleton& skeleton) {
  const mvn::JointTable& table = mvn::joint_table(skeleton.joints.size() == mvn::kSegments);
  if (skeleton.joints.size() != table.count || !rests_unturned(skeleton)) return false;
  for (std::size_t j = 0; j < table.count; ++j) {
    const Joint& joint = skeleton.joints[j];
    if (joint.parent != table.parent[j] || joint.name != mvn::segment_name(table.segment[j])) {
      return false;
    }
  }
  return true;
}

// The character to which the skeleton belongs.
void set_offsets(const Skeleton& skeleton, mvn::Character& character) {
  const mvn::JointTable& table = mvn::joint_table(character.fingers);
  for (std::size_t j = 0; j < table.count; ++j) {
    const Eigen::Vector3f offset_m = skeleton.joints[j].offset_m.cast<float>();
    character.offset_m[table.segment[j]] = {offset_m.x(), offset_m.y(), offset_m.z()};
  }
}

class MvnEncoder final : public DatagramEncoder {
 public:
  MvnEncoder(std::size_t places, bool euler)
      : type_(euler ? mvn::Type::kEuler : mvn::Type::kQuaternion),
        people_(places),
        names_(places) {}

  Result<> set_person(std::size_t place, const LiveStream* stream) override {
    auto& person = people_[place];
    person.reset();
    names_[place].clear();
    begin_sample();
    if (stream == nullptr) return {};
    const auto id = static_cast<std::uint8_t>(place);
    const bool own = stream->skeleton != nullptr && is_mvn_character(*stream->skeleton);
    const bool fingers = stream->skeleton != nullptr && has_fingers(*stream->skeleton);
    const std::string name =
        distinct_name(own ? stream->skeleton->name : stream->name, stream->name, place, names_);
    auto fit = TRY(Fit::make(stream->skeleton, own, [&](double scale) {
      return mvn::skeleton_of(mvn::average_character(id, name, static_cast<float>(scale), fingers));
    }));
    mvn::Character character =
        mvn::average_character(id, name, 1.0F, fit.skeleton().joints.size() == mvn::kSegments);
    set_offsets(fit.skeleton(), character);
    person.emplace(std::move(fit), character);
    return {};
  }

  bool take(std::size_t place, const Frame& frame) override {
    auto& person = people_[place];
    if (!person) return false;
    const mvn::JointTable& table = mvn::joint_table(person->character.fingers);
    const Frame& pose = person->fit.apply(frame);
    for (std::size_t j = 0; j < table.count; ++j) {
      person->rotations[table.segment[j]] = pose.rotation_xyzw[j];
    }
    person->root_m = pose.root_position_m;
    advance(person->time_ns, frame.header);
    person->timecode = frame.timecode;
    person->waits = true;
    return true;
  }

  void describe(const SendDatagram& send) override {
    for (const auto& person : people_) {
      if (!person) continue;
      const mvn::Character& character = person->character;
      send(mvn::encode_datagram(head_of(*person, mvn::Type::kMeta),
                                mvn::encode_meta({character.name.data(), character.name_bytes})));
      send(mvn::encode_datagram(head_of(*person, mvn::Type::kScale),
                                mvn::encode_scale(mvn::t_pose_of(character))));
    }
  }
  std::int64_t describe_every_ns() const noexcept override { return kNanosPerSecond; }

  // People of one source come with the same frame: they have the same number, until one of them
  // comes again.
  void encode(const SendDatagram& send) override {
    const bool again = std::ranges::any_of(
        people_, [](const auto& person) { return person && person->waits && person->sent; });
    if (again) begin_sample();
    for (auto& person : people_) {
      if (!person) continue;
      if (!std::exchange(person->waits, false)) continue;
      person->sent = true;
      encode_person(*person, send);
    }
  }

 private:
  struct Person {
    Person(Fit fitted, const mvn::Character& described)
        : fit(std::move(fitted)), character(described) {}
    Fit fit;
    mvn::Character character;
    mvn::Rotations rotations{};
    Vec3f root_m{};
    std::int64_t time_ns = 0;
    Timecode timecode{};
    bool waits = false, sent = false;  // sent: in the sample of this number
  };

  void begin_sample() {
    ++sample_;
    for (auto& person : people_) {
      if (person) person->sent = false;
    }
  }

  [[nodiscard]] mvn::Head head_of(const Person& person, mvn::Type type) const {
    const mvn::Character& character = person.character;
    const std::int64_t since_ns = begin_ns_ == kNoTime_ns ? 0 : person.time_ns - begin_ns_;
    return {.type = type,
            .sample = sample_,
            .items = 1,
            .time_ms = static_cast<std::uint32_t>(std::max<std::int64_t>(since_ns, 0) / 1'000'000),
            .character = character.id,
            .body = mvn::kBodySegments,
            .fingers = static_cast<std::uint8_t>(character.segments() - mvn::kBodySegments)};
  }

  void encode_person(const Person& person, const SendDatagram& send) {
    if (begin_ns_ == kNoTime_ns) begin_ns_ = person.time_ns;
    // MVN sends no frames, but thousandths of a second.
    const std::string_view timecode = view_of(person.timecode);
    if (timecode.find('.') != std::string_view::npos) {
      send(mvn::encode_datagram(head_of(person, mvn::Type::kTimeCode),
                                mvn::encode_timecode(timecode)));
    }
    const auto payload = mvn::encode_pose(
        type_, mvn::pose_of(person.character, person.root_m, person.rotations, /*local=*/false));
    for (const auto& part : mvn::encode_sample(head_of(person, type_), payload, kMaxDatagram)) {
      send(part);
    }
  }

  mvn::Type type_;
  std::vector<std::optional<Person>> people_;  // [place], which is the character's number
  std::vector<std::string> names_;             // [place]
  std::uint32_t sample_ = 0;
  std::int64_t begin_ns_ = kNoTime_ns;  // the zero of the time that is sent
};

}  // namespace

std::unique_ptr<DatagramEncoder> mvn_encoder(const config::OutputConfig& config) {
  return std::make_unique<MvnEncoder>(config.people(), config.euler);
}

}  // namespace posed::output
