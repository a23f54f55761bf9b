// Real signs in which it is known what the thumb touches, from the manual alphabet of LIBRAS.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "models/hand/contacts.hpp"
#include "tests/support/real_pose_corpus.hpp"

namespace posed::test {

struct ThumbSign {
  std::string name;
  hand::Fingers touched;  // bit 1: the index finger
  char twins;             // signs that are left out of a fit together
};
inline const std::vector<ThumbSign> kThumbSigns{
    {"O", 0b00110, 'o'}, {"0", 0b00010, 'o'}, {"D", 0b00100, 'd'}, {"V", 0b01000, 'v'},
    {"U", 0b01000, 'v'}, {"W", 0b10000, 'w'}, {"S", 0b00100, 's'}, {"I", 0b00100, 'i'},
    {"F", 0b00010, 'f'}, {"T", 0b00010, 'f'}};

// Six of a sign's poses.
inline std::vector<HandAngles> sign_poses(const std::filesystem::path& folder,
                                          const std::string& sign) {
  constexpr Eigen::Index kEach = 17;
  const auto rows = libras_poses(folder, sign);
  std::vector<HandAngles> poses;
  for (Eigen::Index i = 0; i < rows.rows(); i += kEach) {
    HandAngles& angles = poses.emplace_back();
    for (std::size_t c = 0; c < angles.size(); ++c) {
      angles[c] = rows(i, static_cast<Eigen::Index>(c));
    }
  }
  return poses;
}

}  // namespace posed::test
