#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "daemon/output/datagram_encoder.hpp"
#include "daemon/output/fit.hpp"
#include "drivers/rokoko/decoder.hpp"
#include "drivers/rokoko/encode.hpp"
#include "proto/clip/text.hpp"
#include "proto/text/json_text.hpp"

namespace posed::output {
namespace {

namespace rokoko = drivers::rokoko;

// Whether the joints are those that Studio would describe.
bool is_studio_actor(const Skeleton& skeleton) {
  rokoko::JointSet joints;
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    const Joint& joint = skeleton.joints[j];
    const std::size_t studio = rokoko::joint_named(joint.name);
    if (studio == rokoko::kStudioJoints || (j == 0) != (studio == 0)) return false;
    joints.set(studio);
    const int parent = rokoko::parent_among(joints, studio);
    const std::string_view above =
        joint.parent < 0 ? "" : std::string_view(skeleton.joints[joint.parent].name);
    if (above != (parent < 0 ? "" : rokoko::studio_joint(parent).name)) return false;
  }
  return skeleton.root_joint == 0;
}

// How high an actor and the hip stand in T-pose, which receivers scale by.
struct Heights {
  double total_m = 0.0, hip_m = 0.0;
};
Heights heights_of(const Skeleton& skeleton) {
  constexpr double kHeadTop_m = 0.15;  // above the last joint
  std::vector<double> y_m;
  for (const Joint& joint : skeleton.joints) {
    if (joint.parent < 0) {
      y_m.push_back(0.0);
      continue;
    }
    const Eigen::Vector3d offset_m = skeleton.joints[joint.parent].T_world_joint * joint.offset_m;
    y_m.push_back(y_m[joint.parent] + offset_m.y());
  }
  const auto [lowest_m, highest_m] = std::ranges::minmax(y_m);
  return {.total_m = highest_m - lowest_m + kHeadTop_m, .hip_m = -lowest_m};
}

// Whether the samples are a face as Studio's decoder gives it, of values from 0 to 1.
bool is_face(const drivers::SampleLayout& samples) {
  if (samples.names.size() != rokoko::kFaceValues) return false;
  for (std::size_t i = 0; i < rokoko::kFaceValues; ++i) {
    if (samples.names[i] != rokoko::face_value_name(i)) return false;
  }
  return true;
}

class RokokoEncoder final : public DatagramEncoder {
 public:
  RokokoEncoder(std::size_t places, bool lz4) : lz4_(lz4), people_(places), names_(places) {}

  Result<> set_person(std::size_t place, const LiveStream* stream) override {
    auto& person = people_[place];
    person.reset();
    names_[place].clear();
    if (stream == nullptr) return {};
    const auto& skeleton = stream->skeleton;
    const bool prop = skeleton != nullptr && is_prop(*skeleton);
    const bool own = skeleton != nullptr && (prop || is_studio_actor(*skeleton));
    const std::string name =
        distinct_name(own ? skeleton->name : stream->name, stream->name, place, names_);
    auto fit = TRY(Fit::make(skeleton, own, [&](double scale) {
      const rokoko::JointSet joints =
          has_fingers(*skeleton) ? rokoko::JointSet().set() : rokoko::without_fingers();
      return rokoko::skeleton_of(rokoko::average_person(name, joints, static_cast<float>(scale)),
                                 name);
    }));
    if (stream->rate_hz > 0.0) rate_hz_ = stream->rate_hz;
    const bool face = !prop && is_face(stream->samples);
    std::string head = head_of(fit.skeleton(), name, prop, face);
    person.emplace(std::move(fit), std::move(head), prop);
    if (face) person->face_head = ",\"face\":{\"faceId\":" + json_text(nlohmann::json(name));
    return {};
  }

  void take_sample(std::size_t place, const Sample& sample) override {
    auto& person = people_[place];
    if (!person || person->face_head.empty()) return;
    for (std::size_t i = 0; i < rokoko::kFaceValues; ++i) {
      if (sample.valid[i]) person->face[i] = sample.value[i];
    }
  }

  bool take(std::size_t place, const Frame& frame) override {
    auto& person = people_[place];
    if (!person) return false;
    person->pose = person->fit.apply(frame);
    person->pose.valid.set();  // what was not measured stands as in T-pose
    person->posed = true;
    advance(time_ns_, frame.header);
    if (begin_ns_ == kNoTime_ns) begin_ns_ = time_ns_;
    return true;
  }

  void describe(const SendDatagram& /*send*/) override {}
  std::int64_t describe_every_ns() const noexcept override { return kNanosPerSecond; }

  void encode(const SendDatagram& send) override {
    json_ = R"({"version":"3.0","fps":)";  // keeps the memory of the frame before
    json_ += clip::number_text(rate_hz_);
    json_ += R"(,"scene":{"timestamp":)";
    std::array<char, 32> time{};
    const auto [end, error] =
        std::to_chars(time.data(), time.data() + time.size(), seconds(time_ns_ - begin_ns_),
                      std::chars_format::fixed, 6);
    json_.append(time.data(), end);
    json_ += R"(,"actors":[)";
    append_all(/*props=*/false);
    json_ += R"(],"props":[)";
    append_all(/*props=*/true);
    json_ += "]}}";
    if (lz4_) return send(lz4_writer_.compress(json_));
    send(std::as_bytes(std::span(json_)));
  }

 private:
  struct Person {
    Person(Fit fitted, std::string named, bool is_a_prop)
        : fit(std::move(fitted)), head(std::move(named)), prop(is_a_prop) {}
    Fit fit;
    std::string head;       // the JSON up to the joints
    std::string face_head;  // that of the face up to its values; empty: there is none
    std::array<float, rokoko::kFaceValues> face{};
    bool prop;
    Frame pose{};
    bool posed = false;
  };

  static std::string head_of(const Skeleton& skeleton, const std::string& name, bool prop,
                             bool face) {
    const std::string head =
        "{\"name\":" + json_text(nlohmann::json(name)) + ",\"color\":[128,128,128],";
    if (prop) return head + "\"type\":0,";
    const std::string gloves = has_fingers(skeleton) ? "true" : "false";
    const Heights heights = heights_of(skeleton);
    return head + "\"meta\":{\"hasGloves\":" + gloves + ",\"hasLeftGlove\":" + gloves +
           ",\"hasRightGlove\":" + gloves +
           ",\"hasBody\":true,\"hasFace\":" + (face ? "true" : "false") +
           "},\"dimensions\":{\"totalHeight\":" + clip::number_text(heights.total_m) +
           ",\"hipHeight\":" + clip::number_text(heights.hip_m) + "},\"body\":{";
  }

  // Studio counts to 100.
  void append_face(const Person& person) {
    if (person.face_head.empty()) return;
    json_ += person.face_head;
    for (std::size_t i = 0; i < rokoko::kFaceValues; ++i) {
      json_ += ",\"";
      json_ += rokoko::face_value_name(i);
      json_ += "\":";
      json_ += clip::number_text(100.0 * static_cast<double>(person.face[i]));
    }
    json_ += '}';
  }

  void append_all(bool props) {
    bool first = true;
    for (const auto& person : people_) {
      if (!person || !person->posed || person->prop != props) continue;
      if (!std::exchange(first, false)) json_ += ',';
      json_ += person->head;
      if (props) {
        rokoko::append_transform(json_, person->pose.root_position_m,
                                 person->pose.rotation_xyzw[0]);
      } else {
        rokoko::append_joints(json_, person->fit.skeleton(), person->pose);
        json_ += '}';
        append_face(*person);
      }
      json_ += '}';
    }
  }

  bool lz4_;
  std::vector<std::optional<Person>> people_;  // [place]
  std::vector<std::string> names_;             // the same
  double rate_hz_ = 60.0;                      // until a stream says it
  std::int64_t time_ns_ = 0, begin_ns_ = kNoTime_ns;
  std::string json_;
  rokoko::Lz4Writer lz4_writer_;
};

}  // namespace

std::unique_ptr<DatagramEncoder> rokoko_encoder(const config::OutputConfig& config) {
  return std::make_unique<RokokoEncoder>(config.people(), config.lz4);
}

}  // namespace posed::output
