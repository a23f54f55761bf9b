// Skeletons as makers write them: one person, with any maker's names, zero pose, axes and unit, and
// a walk whose truth is known.
#pragma once

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "proto/rig/recognise.hpp"

namespace posed::test {

using rig::Mat;
using rig::Vec;

struct Scheme {
  std::array<const char*, 2> sides;
  std::array<const char*, 14> names;  // '*' is the side; the limbs' begin at the sixth
};

inline constexpr std::array<Scheme, 23> kSchemes{{
    // a prime number: each goes with all else
    {{"Left", "Right"},
     {"mixamorig:Hips", "mixamorig:Spine", "mixamorig:Spine1", "mixamorig:Spine2", "mixamorig:Neck",
      "mixamorig:Head", "mixamorig:*Shoulder", "mixamorig:*Arm", "mixamorig:*ForeArm",
      "mixamorig:*Hand", "mixamorig:*UpLeg", "mixamorig:*Leg", "mixamorig:*Foot",
      "mixamorig:*ToeBase"}},
    {{"L", "R"},
     {"Bip01 Pelvis", "Bip01 Spine", "Bip01 Spine1", "Bip01 Spine2", "Bip01 Neck", "Bip01 Head",
      "Bip01 * Clavicle", "Bip01 * UpperArm", "Bip01 * Forearm", "Bip01 * Hand", "Bip01 * Thigh",
      "Bip01 * Calf", "Bip01 * Foot", "Bip01 * Toe0"}},
    {{"l", "r"},
     {"hip", "abdomen", "chest", "chestUpper", "neck", "head", "*Collar", "*Shldr", "*ForeArm",
      "*Hand", "*Thigh", "*Shin", "*Foot", "*Toe"}},
    {{"L", "R"},
     {"J_Bip_C_Hips", "J_Bip_C_Spine", "J_Bip_C_Chest", "J_Bip_C_UpperChest", "J_Bip_C_Neck",
      "J_Bip_C_Head", "J_Bip_*_Shoulder", "J_Bip_*_UpperArm", "J_Bip_*_LowerArm", "J_Bip_*_Hand",
      "J_Bip_*_UpperLeg", "J_Bip_*_LowerLeg", "J_Bip_*_Foot", "J_Bip_*_ToeBase"}},
    {{"l", "r"},
     {"root", "lowerback", "upperback", "thorax", "lowerneck", "head", "*clavicle", "*humerus",
      "*radius", "*wrist", "*femur", "*tibia", "*foot", "*toes"}},
    {{"Left", "Right"},
     {"Pelvis", "L5", "L3", "T8", "Neck", "Head", "*Shoulder", "*UpperArm", "*ForeArm", "*Hand",
      "*UpperLeg", "*LowerLeg", "*Foot", "*Toe"}},
    {{"l", "r"},
     {"root", "torso_1", "torso_2", "torso_3", "neck_1", "head", "*_shoulder", "*_up_arm",
      "*_low_arm", "*_hand", "*_up_leg", "*_low_leg", "*_foot", "*_toes"}},
    {{"l", "r"},
     {"pelvis", "spine_01", "spine_02", "spine_03", "neck_01", "head", "clavicle_*", "upperarm_*",
      "lowerarm_*", "hand_*", "thigh_*", "calf_*", "foot_*", "ball_*"}},
    {{"Left", "Right"},
     {"Hips", "Chest", "Chest2", "Chest3", "Neck", "Head", "*Collar", "*UpArm", "*LowArm", "*Hand",
      "*UpLeg", "*LowLeg", "*Foot", "*Toe"}},
    {{"左", "右"},
     {"下半身", "上半身", "上半身2", "上半身3", "首", "頭", "*肩", "*腕", "*ひじ", "*手首", "*足",
      "*ひざ", "*足首", "*つま先"}},
    {{"Left", "Right"},
     {"Hips", "Spine", "Spine1", "Spine2", "Neck", "Head", "*Collar", "*Shoulder", "*Elbow",
      "*Wrist", "*Hip", "*Knee", "*Ankle", "*Foot"}},
    {{"L", "R"},
     {"Hip", "Ab", "Chest", "UpperChest", "Neck", "Head", "*Shoulder", "*UArm", "*FArm", "*Hand",
      "*Thigh", "*Shin", "*Foot", "*Toe"}},
    {{"L", "R"},
     {"ValveBiped.Bip01_Pelvis", "ValveBiped.Bip01_Spine", "ValveBiped.Bip01_Spine1",
      "ValveBiped.Bip01_Spine2", "ValveBiped.Bip01_Neck1", "ValveBiped.Bip01_Head1",
      "ValveBiped.Bip01_*_Clavicle", "ValveBiped.Bip01_*_UpperArm", "ValveBiped.Bip01_*_Forearm",
      "ValveBiped.Bip01_*_Hand", "ValveBiped.Bip01_*_Thigh", "ValveBiped.Bip01_*_Calf",
      "ValveBiped.Bip01_*_Foot", "ValveBiped.Bip01_*_Toe0"}},
    // A hand and a foot of names that no table has, between others that are known.
    {{"l", "r"},
     {"pelvis", "lumbar", "torso", "thorax", "cervical", "skull", "clavicle_*", "humerus_*",
      "radius_*", "carpals_*", "femur_*", "tibia_*", "talus_*", "toes_*"}},
    {{"Links", "Rechts"},
     {"Becken", "Wirbel1", "Wirbel2", "Brust", "Hals", "Kopf", "Schluesselbein*", "Oberarm*",
      "Unterarm*", "Hand*", "Oberschenkel*", "Unterschenkel*", "Fuss*", "Zehen*"}},
    {{"L", "R"},
     {"CATRigPelvis", "CATRigSpine1", "CATRigSpine2", "CATRigRibcage", "CATRigNeck", "CATRigHead",
      "CATRig*ArmCollarbone", "CATRig*Arm1", "CATRig*Arm2", "CATRig*ArmPalm", "CATRig*Leg1",
      "CATRig*Leg2", "CATRig*LegAnkle", "CATRig*LegDigit11"}},
    // Letters that count, signs that FBX programs write as numbers, and "fore" apart from its arm.
    {{"l", "r"},
     {"j_kosi", "j_sebo_a", "j_sebo_b", "j_sebo_c", "j_kubi", "j_kao", "j_sako_*", "j_ude_a_*",
      "j_ude_b_*", "j_te_*", "j_asi_a_*", "j_asi_b_*", "j_asi_c_*", "j_asi_d_*"}},
    {{"L", "R"},
     {"Bip01FBXASC032Pelvis", "Bip01FBXASC032Spine", "Bip01FBXASC032Spine1", "Bip01FBXASC032Spine2",
      "Bip01FBXASC032Neck", "Bip01FBXASC032Head", "Bip01FBXASC032*FBXASC032Clavicle",
      "Bip01FBXASC032*FBXASC032UpperArm", "Bip01FBXASC032*FBXASC032Forearm",
      "Bip01FBXASC032*FBXASC032Hand", "Bip01FBXASC032*FBXASC032Thigh",
      "Bip01FBXASC032*FBXASC032Calf", "Bip01FBXASC032*FBXASC032Foot",
      "Bip01FBXASC032*FBXASC032Toe0"}},
    {{"L", "R"},
     {"Pelvis", "SPINE1", "SPINE2", "Chest", "Neck", "Head", "*Arm_Collarbone", "*Arm_UpperArm",
      "*Arm_ForeArm1", "*Arm_Hand", "*Leg_Thigh", "*Leg_Calf", "*Leg_Foot", "*Leg_Toe1"}},
    {{"left", "right"},
     {"hips", "spine_lower", "spine_mid", "spine_upper", "neck", "head", "*_clavicle",
      "*_arm_upper", "*_arm_lower", "*_hand", "*_leg_upper", "*_leg_lower", "*_foot", "*_toe"}},
    {{"Left", "Right"},
     {"mPelvis", "mTorso", "mSpine3", "mChest", "mNeck", "mHead", "mCollar*", "mShoulder*",
      "mElbow*", "mWrist*", "mHip*", "mKnee*", "mAnkle*", "mFoot*"}},
    {{"L", "R"},
     {"Root_M", "Spine1_M", "Spine2_M", "Chest_M", "Neck_M", "Head_M", "Scapula_*", "Shoulder_*",
      "Elbow_*", "Wrist_*", "Hip_*", "Knee_*", "Ankle_*", "Toes_*"}},
    // The part, its side and number, then the joint within it.
    {{"L", "R"},
     {"spine_C0_pelvis_jnt", "spine_C0_0_jnt", "spine_C0_1_jnt", "spine_C0_2_jnt", "neck_C0_0_jnt",
      "neck_C0_head_jnt", "shoulder_*0_shoulder_jnt", "arm_*0_0_jnt", "arm_*0_1_jnt",
      "arm_*0_end_jnt", "leg_*0_0_jnt", "leg_*0_1_jnt", "leg_*0_end_jnt", "foot_*0_0_jnt"}},
}};

inline constexpr int kMakerJoints = 22;  // the first bones of the enum, which are depth first

inline std::string maker_name(const Scheme& scheme, Bone bone) {
  const int b = static_cast<int>(bone);
  const bool arm = b < static_cast<int>(Bone::kLeftUpperLeg);
  const int limb = b - (arm ? 6 : 14);
  std::string name = scheme.names[b < 6 ? b : (arm ? 6 : 10) + limb % 4];
  if (const auto at = name.find('*'); at != std::string::npos) {
    name.replace(at, 1, scheme.sides[limb / 4]);
  }
  return name;
}

inline int maker_parent(int b) {
  if (b == static_cast<int>(Bone::kLeftShoulder) || b == static_cast<int>(Bone::kRightShoulder)) {
    return static_cast<int>(Bone::kUpperChest);
  }
  const bool leg =
      b == static_cast<int>(Bone::kLeftUpperLeg) || b == static_cast<int>(Bone::kRightUpperLeg);
  return leg ? 0 : b - 1;
}

// The local axis along a bone of a folded zero pose, and the one that points left, or, of an arm,
// down.
struct BoneAxes {
  Vec along = rig::kX;
  Vec lateral = rig::kZ;
};

// How a person differs from the usual one: factors on lengths, how far an A-pose's arms hang, and
// the axes of a folded zero pose's trunk, arms and legs.
struct Build {
  double height = 1.0, trunk = 1.0, arms = 1.0, legs = 1.0, shoulders = 1.0;
  double arms_down_deg = 45.0;
  std::array<BoneAxes, 3> axes{};
};

// From each joint's parent to it in the T-pose [m].
inline Vec maker_offset(int b, const Build& build = {}) {
  static const std::array<Vec, 14> kOffsets{{{0, .93, 0},
                                             {0, .1, 0},
                                             {0, .12, 0},
                                             {0, .13, 0},
                                             {0, .18, 0},
                                             {0, .09, 0},
                                             {.03, .12, 0},
                                             {.14, 0, 0},
                                             {.28, 0, 0},
                                             {.25, 0, 0},
                                             {.09, -.04, 0},
                                             {0, -.42, 0},
                                             {0, -.4, 0},
                                             {0, -.07, .13}}};
  if (b < 6) return build.height * (b == 0 ? build.legs : build.trunk) * kOffsets[b];
  const int limb = (b - 6) % 8;
  const bool right = limb >= 4;
  const bool arm = b < 14;
  Vec offset = kOffsets[(arm ? 6 : 10) + limb % 4];
  if (right) offset.x() = -offset.x();
  const bool at_trunk = limb % 4 == 0 || (arm && limb % 4 == 1);
  return build.height * (at_trunk ? build.shoulders : arm ? build.arms : build.legs) * offset;
}

enum class ZeroPose { kT, kA, kArmsDown, kFolded };

// T of the joint in the figure's own axes.
inline Mat maker_t(int b, ZeroPose zero, const Build& build = {}) {
  const bool arm = b > 6 && b < 14 && b != 10;
  const bool left = b < 10 || (b >= 14 && b < 18);
  if (zero == ZeroPose::kFolded) {  // every bone along one of its own axes, as LaFAN1
    const BoneAxes& axes = build.axes[b < 6 ? 0 : b < 14 ? 1 : 2];
    Vec to = rig::kY;
    Vec lateral = rig::kX;
    if (b >= 6 && b < 14) {
      to = left ? rig::kX : Vec(-rig::kX);
      lateral = left ? Vec(-rig::kY) : rig::kY;
    } else if (b >= 14) {
      to = (b - 14) % 4 >= 2 ? maker_offset(17) : Vec(-rig::kY);
    }
    return rig::frame(axes.along, to, axes.lateral, lateral);
  }
  if (!arm || zero == ZeroPose::kT) return Mat::Identity();
  const double raise = (zero == ZeroPose::kA ? build.arms_down_deg : 88.0) * kDegree;
  return Eigen::AngleAxisd(left ? raise : -raise, rig::kZ).toRotationMatrix();
}

struct Made {
  rig::RigInput input;
  std::vector<Mat> T;      // [joint], the truth
  std::vector<Bone> bone;  // [joint]; empty: in the order of the enum
};

// Canonical local rotation of each joint in frame `i` of a walk: knees, elbows and shoulders move,
// soles stay flat.
inline std::vector<Mat> walk_pose(int i) {
  const auto about = [](const Vec& axis, double deg) {
    return Eigen::AngleAxisd(deg * kDegree, axis).toRotationMatrix();
  };
  std::vector<Mat> local(kMakerJoints, Mat::Identity());
  for (const bool left : {true, false}) {
    const double phase = 0.21 * i + (left ? 0.0 : 3.14159);
    const int arm = left ? 7 : 11;
    const int leg = left ? 14 : 18;
    local[arm] = about(rig::kX, 20 * std::sin(phase)) * about(rig::kZ, left ? -75 : 75);
    local[arm + 1] = about(rig::kY, (left ? -1 : 1) * (35 + 15 * std::sin(phase)));
    local[leg] = about(rig::kX, 25 * std::sin(phase));
    local[leg + 1] = about(rig::kX, 30 + 25 * std::cos(phase));
    local[leg + 2] = (local[leg] * local[leg + 1]).transpose();
  }
  return local;
}

// `from_figure` turns the figure's axes into the file's.
inline Made make(const Scheme& scheme, ZeroPose zero, const Mat& from_figure,
                 double metres_per_unit, int first_frame = 0, int frames = 40,
                 const Build& build = {}) {
  Made made;
  std::vector<Vec> offsets;
  for (int b = 0; b < kMakerJoints; ++b) {
    const int parent = b == 0 ? -1 : maker_parent(b);
    const Mat T_parent = parent < 0 ? Mat(Mat::Identity()) : maker_t(parent, zero, build);
    const Vec offset =
        from_figure * T_parent.transpose() * maker_offset(b, build) / metres_per_unit;
    made.input.joints.push_back({.name = maker_name(scheme, static_cast<Bone>(b)),
                                 .parent = parent,
                                 .offset = offset,
                                 .end_site = {}});
    if (b == static_cast<int>(Bone::kHead)) {
      made.input.joints.back().end_site =
          from_figure * maker_t(b, zero, build).transpose() * Vec(0, .18, 0) / metres_per_unit;
    }
    made.T.push_back(maker_t(b, zero, build) * from_figure.transpose());
  }
  auto& poses = made.input.poses;
  poses.count = frames;
  for (int i = 0; i < frames; ++i) {
    const auto local = walk_pose(first_frame + i);
    for (int b = 0; b < kMakerJoints; ++b) {
      const int parent = made.input.joints[b].parent;
      const Mat T_parent = parent < 0 ? Mat(from_figure.transpose()) : made.T[parent];
      poses.rotation.emplace_back(Mat(T_parent.transpose() * local[b] * made.T[b]));
      const Vec walked = from_figure * Vec(0, 0, 0.04 * (first_frame + i)) / metres_per_unit;
      poses.position.push_back(made.input.joints[b].offset + (b == 0 ? walked : Vec(Vec::Zero())));
    }
  }
  return made;
}

}  // namespace posed::test
