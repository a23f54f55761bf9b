#include <chrono>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "daemon/output/datagram_encoder.hpp"
#include "daemon/output/fit.hpp"
#include "daemon/system/clock.hpp"
#include "drivers/mocopi/encode.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::output {
namespace {

namespace mocopi = drivers::mocopi;

// The app's number of each joint; empty where the joints are not those of the app.
std::vector<std::uint16_t> bone_numbers(const Skeleton& skeleton) {
  std::set<std::uint16_t> taken;
  std::vector<std::uint16_t> numbers;
  for (const Joint& joint : skeleton.joints) {
    std::uint16_t number = 0;
    while (number < mocopi::kBones && mocopi::bone_name(number) != joint.name) ++number;
    if (number == mocopi::kBones || !taken.insert(number).second) return {};
    numbers.push_back(number);
  }
  if (skeleton.root_joint != 0) return {};
  return numbers;
}

// The bones in T-pose.
std::vector<mocopi::BoneEntry> bones_of(const Skeleton& skeleton,
                                        const std::vector<std::uint16_t>& numbers,
                                        const Vec3f& hips_m) {
  std::vector<mocopi::BoneEntry> bones;
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    const Joint& joint = skeleton.joints[j];
    mocopi::BoneEntry& bone = bones.emplace_back();
    bone.id = numbers[j];
    bone.parent = joint.parent < 0 ? mocopi::kNoParent : numbers[joint.parent];
    bone.transform.rotation_xyzw = from_eigen(local_from_canonical(skeleton, j));
    const Eigen::Vector3f offset_m = joint.offset_m.cast<float>();
    bone.transform.position_m =
        joint.parent < 0 ? hips_m : Vec3f{offset_m.x(), offset_m.y(), offset_m.z()};
  }
  return bones;
}

double unix_since_monotonic_s() {
  const auto unix_time = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration<double>(unix_time).count() - seconds(system::monotonic_ns());
}

class MocopiEncoder final : public DatagramEncoder {
 public:
  Result<> set_person(std::size_t /*place*/, const LiveStream* stream) override {
    fit_.reset();
    if (stream == nullptr) return {};
    auto numbers = stream->skeleton == nullptr ? std::vector<std::uint16_t>{}
                                               : bone_numbers(*stream->skeleton);
    double height = 1.0;
    auto fit = TRY(Fit::make(stream->skeleton, !numbers.empty(), [&](double scale) {
      height = scale;
      return mocopi::average_skeleton(static_cast<float>(scale));
    }));
    if (numbers.empty()) numbers = bone_numbers(fit.skeleton());
    const auto average = mocopi::average_bones(static_cast<float>(height));
    bones_ = bones_of(fit.skeleton(), numbers, average[0].transform.position_m);
    pose_ = bones_;
    fit_.emplace(std::move(fit));
    return {};
  }

  bool take(std::size_t /*place*/, const Frame& frame) override {
    if (!fit_) return false;
    const Frame& pose = fit_->apply(frame);
    for (std::size_t j = 0; j < pose_.size(); ++j) {
      pose_[j].transform.rotation_xyzw = pose.rotation_xyzw[j];
    }
    pose_[0].transform.position_m = pose.root_position_m;
    advance(time_ns_, frame.header);
    if (begin_ns_ == kNoTime_ns) begin_ns_ = time_ns_;
    return true;
  }

  void describe(const SendDatagram& send) override { send(mocopi::encode_skeleton(bones_)); }
  std::int64_t describe_every_ns() const noexcept override { return 2 * kNanosPerSecond; }
  void encode(const SendDatagram& send) override {
    send(mocopi::encode_frame(number_++, seconds(time_ns_ - begin_ns_), unix_s_ + seconds(time_ns_),
                              pose_));
  }

 private:
  const double unix_s_ = unix_since_monotonic_s();  // of the zero of monotonic time
  std::optional<Fit> fit_;                          // none: nobody is there
  std::vector<mocopi::BoneEntry> bones_;            // in T-pose
  std::vector<mocopi::BoneEntry> pose_;
  std::uint32_t number_ = 0;
  std::int64_t time_ns_ = 0, begin_ns_ = kNoTime_ns;
};

}  // namespace

std::unique_ptr<DatagramEncoder> mocopi_encoder() { return std::make_unique<MocopiEncoder>(); }

}  // namespace posed::output
