// PoseSpace: turns a frame into the vector q that a style model is trained on, and puts a change of
// q back into the frame (models/motion/README.md, "Pose spaces"). Heading and position of the root
// are not part of the style; they are removed before and restored after.
//
//   native    rotation vectors [rad] of the source's own joints about the training mean,
//             q_j = log(Rmean_j^T R_j), R_j' = Rmean_j exp(q_j'); 3 per joint, the root first with
//             its heading removed
//   humanoid  the same on the canonical skeleton
//   cmu43     the Euler angles [rad] of Sato et al. (models/motion/README.md, References) of an
//   Acclaim skeleton
//             (root 3 + 40); joints are found by their names in an ASF or in a BVH made from it
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::motion {

inline constexpr int kMaxPoseDims = kMaxChannels;
inline constexpr int kCmu43Joints = 19;

enum class Space : std::uint8_t { kNative, kCmu43, kHumanoid };
[[nodiscard]] std::string_view space_name(Space space);
Result<Space> space_from_name(std::string_view name);

// What a model stores of its space.
struct PoseSpaceSpec {
  Space space = Space::kNative;
  std::vector<std::string>
      joints;  // source joint names (native, cmu43) or VRM bones (humanoid), q's order
  std::vector<Eigen::Quaterniond> mean;  // Rmean, one a joint; empty for cmu43
  int root = 0;                          // index in `joints` of the joint whose heading is removed
};

// The spec of `space` on `skeleton`, with identity for every mean (cmu43 has none); it lists the
// joints that a model trained on such clips has. Fails for cmu43 if joints of it are missing, which
// the error names, and for humanoid if the skeleton has no bone of a person.
Result<PoseSpaceSpec> describe_space(Space space, const Skeleton& skeleton);

// True where the skeleton has the bones that every humanoid space needs: the hips, and of upper and
// lower arms and legs one side's at least.
[[nodiscard]] bool is_person(const Skeleton& skeleton);

// How many dimensions q has in this spec.
[[nodiscard]] int space_dims(const PoseSpaceSpec& spec);

// A spec bound to one skeleton. Const and shareable after bind().
class PoseSpace {
 public:
  // Returns an error that names the missing joints when the skeleton lacks joints of the space.
  static Result<PoseSpace> bind(const PoseSpaceSpec& spec, const Skeleton& skeleton);

  // The same for a person who lacks some bones of a humanoid space, such as toes or a chest: their
  // dimensions are never available. A bone below a missing one (an arm without its shoulder) is
  // seen as if the missing one kept its training mean, and gets the change of both. What
  // is_person() asks for must be there. Other spaces need every joint.
  static Result<PoseSpace> bind_person(const PoseSpaceSpec& spec, const Skeleton& skeleton);

  // The joints of the spec that the skeleton lacks; empty after bind().
  [[nodiscard]] const std::vector<std::string>& missing() const noexcept { return missing_; }

  [[nodiscard]] const Skeleton& skeleton() const noexcept { return *skeleton_; }
  [[nodiscard]] int dims() const noexcept;
  // Which joint of `spec.joints` dimension d belongs to.
  [[nodiscard]] int joint_of_dim(int d) const noexcept;
  // The joint of the skeleton that it is; -1 where the skeleton lacks it.
  [[nodiscard]] int skeleton_joint_of_dim(int d) const noexcept;

  // The angle about +Y by which the root's training mean must be turned to come nearest to this
  // frame's root [rad].
  RT_SAFE [[nodiscard]] double heading_rad(const Frame& frame) const noexcept;

  // False where this frame did not measure the root; heading_rad() then has no meaning.
  RT_SAFE [[nodiscard]] bool has_heading(const Frame& frame) const noexcept;

  // q [dims] of `frame` seen from `heading_rad`; available[d] is 0 where the joint was not measured
  // (q is then 0: the training mean; of cmu43, an angle of zero).
  RT_SAFE void to_vector(const Frame& frame, double heading_rad, std::span<float> q,
                         std::span<std::uint8_t> available) const noexcept;

  // The q [dims] of this space for the pose that is `from_q` [dims] in another.
  // False, and nothing is written, where the two do not describe the same joints.
  RT_SAFE [[nodiscard]] bool convert(const PoseSpace& from, std::span<const float> from_q,
                                     std::span<float> q) const noexcept;

  // Replaces the pose of `frame` by q + delta, rotation vectors about the means or, in cmu43, Euler
  // angles; channel angles included. q and delta [dims] are finite. Joints that are not available
  // and joints outside the space are unchanged; a zero delta leaves every bit of the frame
  // unchanged.
  RT_SAFE void add(Frame& frame, double heading_rad, std::span<const float> q,
                   std::span<const float> delta) const noexcept;

  // Not for cmu43. Gives the joints the pose q [dims], whether they were measured or not; then they
  // are. A joint is unchanged whose q is not finite, or that of a missing joint above it, and one
  // with unmeasured joints between it and the joint of the space above it.
  RT_SAFE void put(Frame& frame, double heading_rad, std::span<const double> q) const noexcept;

 private:
  // One joint of the space. The rotation that q describes is
  //   V = mean^-1 [Ry(-heading) for the root] before (product of `chain`) L after
  // `before` and `after` carry the T frames (humanoid) or the Acclaim axes (cmu43).
  struct Item {
    int joint = 0;      // L is this joint's rotation in the frame; -1: the skeleton lacks it
    int first_dim = 0;  // of q
    int dims = 3;
    std::uint8_t axes = 7;  // cmu43: bit x = 1, y = 2, z = 4 of the listed degrees of freedom
    int chain_begin = 0, chain_end = 0;  // of chain_: joints between V's base and `joint`
    int lost_begin = 0, lost_end = 0;    // of lost_: missing items between the same two
    Eigen::Quaterniond before = Eigen::Quaterniond::Identity();
    Eigen::Quaterniond after = Eigen::Quaterniond::Identity();
    Eigen::Quaterniond own_mean = Eigen::Quaterniond::Identity();
    Eigen::Quaterniond mean = Eigen::Quaterniond::Identity();  // those of lost_, then own_mean
  };

  PoseSpace() = default;
  static PoseSpace bind_joints(const PoseSpaceSpec& spec, const Skeleton& skeleton,
                               const std::vector<int>& joints);
  // Sets what lies between the item and the next joint of the space above it.
  void set_chain(const PoseSpaceSpec& spec, const std::vector<int>& joints, Item& item);
  void set_lost(const PoseSpaceSpec& spec, const std::vector<int>& joints);
  // `mean` after the lost items have turned by their part of q [dims].
  template <typename T>
  [[nodiscard]] Eigen::Quaterniond turned_mean(const Item& item,
                                               std::span<const T> q) const noexcept;
  [[nodiscard]] bool measured(const Item& item, const Frame& frame) const noexcept;
  [[nodiscard]] bool chain_measured(const Item& item, const Frame& frame) const noexcept;
  [[nodiscard]] Eigen::Quaterniond base(const Item& item, const Frame& frame,
                                        double heading_rad) const noexcept;
  [[nodiscard]] Eigen::Quaterniond changed(const Item& item, const Eigen::Quaterniond& rotation,
                                           const float* q, const float* delta) const noexcept;

  std::shared_ptr<const Skeleton> skeleton_;
  std::vector<Item> items_;
  std::vector<int> chain_;
  std::vector<int> lost_;  // items, from above
  std::vector<std::string> missing_;
  std::vector<int> joint_of_dim_;
  int root_ = 0;
  bool euler_ = false;
};

}  // namespace posed::motion
