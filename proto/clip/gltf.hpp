// A motion as binary glTF 2.0, which viewers, engines and modelling programs open. glTF has posed's
// own axes and unit: right-handed, Y up, a figure that faces +Z, metres. Cold.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "proto/clip/clip.hpp"
#include "proto/frame/humanoid.hpp"
#include "proto/frame/result.hpp"

namespace posed::clip {

struct Draft;

struct GltfNode {
  std::string name;
  int parent = -1;
  // At rest, in the parent's frame. The rotation at rest is identity.
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();
  std::vector<float> position_m{};     // [frame x 3], in the parent's frame; empty: it stays
  std::vector<float> rotation_xyzw{};  // [frame x 4], unit length; empty: it does not turn
  std::optional<Bone> bone{};
};

struct GltfMotion {
  std::string name;
  std::vector<float> time_s;    // [frame], from 0, increasing
  std::vector<GltfNode> nodes;  // parents come before their children; the first one is the root
  std::vector<Timecode> timecode{};  // as Clip::timecode
};

enum class GltfKind : std::uint8_t {
  kSkin,          // all nodes are joints of the skin of a mannequin: an armature in Blender
  kVrmAnimation,  // VRMC_vrm_animation 1.0: nodes with a bone are the humanoid's
};

// Times of the clip's frames, from 0. glTF wants each later than the one before it, in the
// precision of a float: frames that came at one moment are set apart by its least step. Fails for a
// clip without frames, and for a time that is before the last one or no number.
Result<std::vector<float>> gltf_times(const Clip& clip);

// Adds the rotation of the next frame, in that of the two signs of a quaternion that is nearer to
// the frame before: a program that interpolates the numbers then goes the shorter way round.
void add_rotation(GltfNode& node, Eigen::Quaterniond rotation);
void add_position(GltfNode& node, const Eigen::Vector3d& position_m);

// The same motion gives the same bytes. Fails when a value is not a finite number, or when the file
// would be longer than a .glb can be (4 GB).
Result<> write_gltf(const GltfMotion& motion, GltfKind kind, const std::filesystem::path& path);

// Writes `clip` as .glb: a node for each joint and each end site, where the skeleton has them at
// rest, and their motion at the clip's own times; and a mannequin that they move.
Result<> write_glb(const Clip& clip, const std::filesystem::path& path);

// Format::read of all kinds of glTF: the bones that a VRM names, otherwise the joints of the skins;
// the first animation that moves them, otherwise the rest pose. Of the numbers in other files
// nothing is read.
Result<Draft> read_gltf(const ClipFile& file, const ReadOptions& options);

}  // namespace posed::clip
